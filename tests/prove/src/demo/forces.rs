//! Checks the forces on an instrument that nothing stops.

use serde::Serialize;

use super::contacts::Touches;
use super::push::Pushed;
use super::session::Outcome;
use super::steps::Steps;

/// The forces on a scripted instrument.
#[derive(Serialize)]
pub struct Forces {
    #[serde(flatten)]
    steps: Steps,
    #[serde(flatten)]
    touches: Touches,
    /// Ticks whose force was compared with that of the wall, and the number of these within its margin.
    forces_compared: usize,
    forces_pushing: usize,
    /// Ticks among these whose search a budget ended, so that the last tick's direction was used.
    forces_kept: usize,
    forces_wrong: usize,
    /// The first tick with a wrong force.
    #[serde(skip)]
    first_wrong_force: u32,
}

impl Forces {
    /// The forces of a run with a script.
    pub fn of(outcome: &Outcome) -> Option<Self> {
        let (steps, touches) = outcome.path.clone()?;
        let pushed = Pushed::of(&outcome.ticks);
        Some(Self {
            steps,
            touches,
            forces_compared: pushed.checked,
            forces_pushing: pushed.pushing,
            forces_kept: pushed.kept,
            forces_wrong: pushed.wrong,
            first_wrong_force: pushed.first,
        })
    }

    /// The promises that the run broke, as text.
    pub fn broken(&self) -> Vec<String> {
        let mut broken = Vec::new();
        let (wrong, first) = (self.forces_wrong, self.first_wrong_force);
        if wrong > 0 {
            broken.push(format!(
                "{wrong} ticks have another force than the wall's, the first is {first}"
            ));
        }
        let Touches { ticks_too_weak, ticks_proxy_too_weak, ticks_proxy_inward, .. } = self.touches;
        let missing = self.touches.ticks_contacts_missing;
        if missing > 0 {
            broken.push(format!("contacts below the list's bound are missing at {missing} ticks"));
        }
        if ticks_too_weak + ticks_proxy_too_weak + ticks_proxy_inward > 0 {
            broken.push(format!(
                "inside, the force is too weak at {ticks_too_weak} ticks and the proxy's at {ticks_proxy_too_weak}, which \
                 points inwards at {ticks_proxy_inward}"
            ));
        }
        broken
    }

    /// Lines for the user.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = vec![("force steps", self.steps.row())];
        rows.extend(self.touches.rows());
        rows.push((
            "forces compared",
            format!(
                "{}, {} of them within the margin, {} along the last tick's direction, {} differ",
                self.forces_compared, self.forces_pushing, self.forces_kept, self.forces_wrong
            ),
        ));
        rows
    }
}
