//! The stand-offs of `dibs filter`: one of all tissue, and larger ones of labels.

use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, Result, anyhow, bail};
use dibs_nostd::filter::Filter;
use dibs_nostd::{Index, Tree};

/// Most labels with a stand-off of their own.
pub const LABELS: usize = <Filter>::MOST_PAIRS - 1;

/// A stand-off (mm): `1` of all tissue, `2=3` of the label 2.
#[derive(Clone, Copy)]
pub struct StandOff {
    label: Option<u8>,
    value: f32,
}

impl FromStr for StandOff {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (label, value) = match text.split_once('=') {
            None => (None, text),
            Some((label, value)) => {
                let label =
                    label.parse().with_context(|| format!("{label}: no label from 0 to 255"))?;
                (Some(label), value)
            }
        };
        let value = value.parse().with_context(|| format!("{value}: no number"))?;
        Ok(Self { label, value })
    }
}

/// The filter that keeps these stand-offs, for a robot of a largest speed (mm/s).
pub fn filter<I: Index>(
    stand_offs: &[StandOff],
    robot: f32,
    (tree, file): (&Tree<'_, I>, &Path),
) -> Result<Filter<LABELS>> {
    let of_all: Vec<f32> =
        stand_offs.iter().filter(|one| one.label.is_none()).map(|one| one.value).collect();
    let [of_all] = of_all[..] else {
        bail!("--stand-off: give exactly one without a label; there are {}", of_all.len());
    };
    if !(of_all >= 0.0 && of_all.is_finite()) {
        bail!("--stand-off is {of_all}: give a number of at least 0");
    }
    let mut of_labels = [(0, of_all); LABELS];
    let mut slots = of_labels.iter_mut();
    for &StandOff { label, value } in stand_offs {
        let Some(label) = label else { continue };
        if !(value >= of_all && value.is_finite()) {
            bail!(
                "--stand-off is {label}={value}: give at least {of_all}, the one without a label"
            );
        }
        if !tree.has_label(label) {
            bail!(
                "--stand-off is {label}={value}: no triangle of {} has this label",
                file.display()
            );
        }
        let slot = slots.next();
        *slot.ok_or_else(|| anyhow!("--stand-off: at most {LABELS} labels have a slot"))? =
            (label, value);
    }
    let filter = Filter::new(of_all, robot)
        .map_err(|_| anyhow!("--robot-speed is {robot}: give a speed above 0"))?;
    Ok(filter.stand_off_of(of_labels)?)
}
