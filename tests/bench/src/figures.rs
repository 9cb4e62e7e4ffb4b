//! The figures, as SVG.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::brain::TOOLS;
use super::imaging;
use super::names::*;
use super::record::{Cell, Record, Records};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A colour that the colour-blind can distinguish from the others (Okabe and Ito).
fn colour(method: &str) -> RGBColor {
    match method {
        DIBS | TRACKER => RGBColor(0, 114, 178),
        TRACKER_AT_LIMIT => RGBColor(0, 60, 110),
        MEASURED | MEASURED_WARM => RGBColor(0, 158, 115),
        PAPER | WARM => RGBColor(86, 180, 233),
        SWEPT => RGBColor(120, 120, 120),
        REFIT => RGBColor(213, 94, 0),
        HYBRID => RGBColor(230, 159, 0),
        OBVHS => RGBColor(204, 121, 167),
        PARRY_BVH => RGBColor(148, 103, 189),
        PARRY_TRIMESH => RGBColor(140, 86, 75),
        _ => RGBColor(0, 0, 0),
    }
}

fn plain(method: &str) -> String {
    title(method).replace('`', "")
}

/// All figures of a run: file names and contents.
pub fn all(records: &Records) -> Result<Vec<(String, String)>> {
    let sheet = |name: &str, size: (u32, u32), draw: &dyn Fn(&Area<'_>) -> Result<()>| {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            area.fill(&WHITE).map_err(|e| anyhow!("{e}"))?;
            draw(&area)?;
            area.present().map_err(|e| anyhow!("{e}"))?;
        }
        Ok::<_, anyhow::Error>((format!("figures/{name}.svg"), svg))
    };
    let mut figures = vec![
        sheet("figure4", (1_080, 560), &|area| {
            for (area, tool) in area.split_evenly((1, 2)).iter().zip(TOOLS) {
                total_against_size(area, records, tool)?;
            }
            Ok(())
        })?,
        sheet("figure6", (1_080, 960), &|area| {
            let panels = [DIBS, MEASURED].into_iter().flat_map(|m| TOOLS.map(|tool| (m, tool)));
            for (area, (method, tool)) in area.split_evenly((2, 2)).iter().zip(panels) {
                crossovers(area, records, method, tool)?;
            }
            Ok(())
        })?,
        sheet("node-tests", (1_080, 720), &|area| {
            let panels = [DIBS, MEASURED].into_iter().flat_map(|m| TOOLS.map(|tool| (m, tool)));
            for (area, (method, tool)) in area.split_evenly((2, 2)).iter().zip(panels) {
                distribution(area, records, method, tool)?;
            }
            Ok(())
        })?,
    ];
    if !records.meshes(imaging::EXPERIMENT).is_empty() {
        figures.push(sheet("imaging", (1_080, 960), &|area| {
            let panels = imaging::SURFACES
                .into_iter()
                .flat_map(|surface| imaging::RATES.map(|rate| imaging::condition(rate, surface)));
            for (area, condition) in area.split_evenly((2, 2)).iter().zip(panels) {
                control_loop(area, records, &condition)?;
            }
            Ok(())
        })?);
    }
    Ok(figures)
}

/// Points of a line: a mesh's size and a value, where it is above 0.
fn line(
    records: &Records,
    experiment: &str,
    tool: &str,
    method: &str,
    metric: &str,
) -> Vec<(f64, f64)> {
    let meshes = records.meshes(experiment);
    let points = meshes.iter().filter_map(|(mesh, triangles)| {
        let found = records.0.iter().find(|r| {
            r.experiment == experiment
                && r.mesh == *mesh
                && r.triangles == *triangles
                && r.tool == tool
                && r.method == method
                && r.metric == metric
        })?;
        (found.median > 0.0).then_some((*triangles as f64, found.median))
    });
    points.collect()
}

/// Figure 4: the time of a step, against the size of the mesh.
fn total_against_size(area: &Area<'_>, records: &Records, tool: &str) -> Result<()> {
    let methods =
        [PAPER, DIBS, MEASURED, REFIT, HYBRID, OBVHS, PARRY_BVH, PARRY_TRIMESH, EXHAUSTIVE];
    let lines = |tool| methods.map(|m| (m, line(records, "brain", tool, m, "total")));
    let caption = format!("Refit and one query, {tool}");
    let axes = Axes::of(&TOOLS.map(lines).concat(), sizes(records, "brain"), "median total, µs");
    chart(area, &caption, &axes, &lines(tool), &[], SeriesLabelPosition::UpperLeft)
}

/// Table 4 as lines: the time of a tick with all work, against the size of the mesh.
fn control_loop(area: &Area<'_>, records: &Records, condition: &str) -> Result<()> {
    let methods = [
        TRACKER,
        TRACKER_AT_LIMIT,
        MEASURED_WARM,
        WARM,
        REFIT,
        HYBRID,
        SWEPT,
        OBVHS,
        PARRY_BVH,
        PARRY_TRIMESH,
    ];
    let lines = |condition: &str| {
        methods.map(|m| (m, line(records, imaging::EXPERIMENT, condition, m, "total")))
    };
    let all = imaging::SURFACES.into_iter().flat_map(|surface| {
        imaging::RATES.into_iter().flat_map(move |rate| lines(&imaging::condition(rate, surface)))
    });
    let sizes = sizes(records, imaging::EXPERIMENT);
    let axes = Axes::of(&all.collect::<Vec<_>>(), sizes, "all work, µs a tick");
    let lines: Vec<_> = lines(condition).into_iter().filter(|(_, l)| !l.is_empty()).collect();
    chart(area, condition, &axes, &lines, &[], SeriesLabelPosition::UpperLeft)
}

/// Figure 6: the rate of motion above which not refitting is faster.
fn crossovers(area: &Area<'_>, records: &Records, ours: &str, tool: &str) -> Result<()> {
    let peers = [REFIT, HYBRID, OBVHS, PARRY_BVH, PARRY_TRIMESH];
    let lines = |ours, tool| peers.map(|m| (m, line(records, "crossover", tool, ours, m)));
    let of_both = |tool| [DIBS, MEASURED].map(|ours| lines(ours, tool)).concat();
    let caption = format!("Crossover of {}, {tool}", plain(ours));
    let marks = [(1.0, "a refit every query"), (0.03, "30 Hz imaging, 1 kHz control")];
    let sizes = sizes(records, "crossover");
    let axes = Axes::of(&TOOLS.map(of_both).concat(), sizes, "refit ratio h_c");
    chart(area, &caption, &axes, &lines(ours, tool), &marks, SeriesLabelPosition::LowerLeft)
}

/// A method and its line.
type Line = (&'static str, Vec<(f64, f64)>);

/// The common axes of all panels of a sheet, so that they can be compared.
struct Axes {
    sizes: Vec<f64>,
    values: Vec<f64>,
    name: &'static str,
}

impl Axes {
    /// For the lines of all panels.
    fn of(lines: &[Line], sizes: Vec<f64>, name: &'static str) -> Self {
        let values = lines.iter().flat_map(|(_, points)| points.iter().map(|p| p.1)).collect();
        Self { sizes, values, name }
    }
}

/// The sizes of an experiment's meshes.
fn sizes(records: &Records, experiment: &str) -> Vec<f64> {
    records.meshes(experiment).iter().map(|&(_, triangles)| triangles as f64).collect()
}

/// Lines in logarithmic axes, each with its name.
fn chart(
    area: &Area<'_>,
    caption: &str,
    axes: &Axes,
    lines: &[Line],
    marks: &[(f64, &str)],
    legend: SeriesLabelPosition,
) -> Result<()> {
    let range = |values: &mut dyn Iterator<Item = f64>, room: f64| {
        let (low, high) = values.fold((f64::MAX, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
        if low > high { 1.0..10.0 } else { low / room..high * room }
    };
    let x = range(&mut axes.sizes.iter().copied(), 1.4);
    let y = range(&mut axes.values.iter().copied().chain(marks.iter().map(|m| m.0)), 1.6);
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 19))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(66)
        .build_cartesian_2d(x.clone().log_scale(), y.log_scale())
        .map_err(|e| anyhow!("{e}"))?;
    chart
        .configure_mesh()
        .x_desc("triangles")
        .y_desc(axes.name)
        .label_style(("sans-serif", 14))
        .x_label_formatter(&|v| {
            if *v >= 1_000.0 { format!("{}k", v / 1_000.0) } else { format!("{v}") }
        })
        .y_label_formatter(&|v| number(*v))
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(220, 220, 220))
        .draw()
        .map_err(|e| anyhow!("{e}"))?;
    for &(value, name) in marks {
        let style = RGBColor(120, 120, 120);
        let at = [(x.start, value), (x.end, value)];
        chart.draw_series(LineSeries::new(at, style)).map_err(|e| anyhow!("{e}"))?;
        let font = ("sans-serif", 13).into_font().color(&style);
        let text =
            Text::new(name.to_owned(), (x.end / 1.05, value * 1.12), font.pos(right_above()));
        chart.draw_series([text]).map_err(|e| anyhow!("{e}"))?;
    }
    for (method, points) in lines {
        let style = colour(method).stroke_width(2);
        chart
            .draw_series(LineSeries::new(points.iter().copied(), style))
            .map_err(|e| anyhow!("{e}"))?
            .label(plain(method))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        chart
            .draw_series(points.iter().map(|&p| Circle::new(p, 3, style.color.filled())))
            .map_err(|e| anyhow!("{e}"))?;
    }
    chart
        .configure_series_labels()
        .position(legend)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 13))
        .draw()
        .map_err(|e| anyhow!("{e}"))?;
    Ok(())
}

fn right_above() -> Pos {
    Pos::new(HPos::Right, VPos::Bottom)
}

/// A number without trailing zeros.
fn number(value: f64) -> String {
    let text = format!("{value:.5}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The distribution of node tests on the brain nearest to 50,000 triangles.
fn distribution(area: &Area<'_>, records: &Records, method: &str, tool: &str) -> Result<()> {
    let nearest = |(_, t): &(String, u64)| t.abs_diff(50_000);
    let Some((mesh, triangles)) = records.meshes("brain").into_iter().min_by_key(nearest) else {
        return Ok(());
    };
    let bins: Vec<&Record> = records
        .0
        .iter()
        .filter(|r| {
            r.experiment == "histogram"
                && r.triangles == triangles
                && r.tool == tool
                && r.method == method
        })
        .collect();
    let cell = Cell::new("brain", &mesh, triangles as usize, tool);
    let of_cell = |r: &&Record| r.triangles == triangles;
    let counts = records.0.iter().filter(of_cell).find(|r| {
        r.experiment == cell.experiment
            && r.tool == tool
            && r.method == method
            && r.metric == "node_tests"
    });
    let Some(counts) = counts else { return Ok(()) };
    let most = bins.iter().map(|r| r.n).max().unwrap_or(1) as f64;
    let right = counts.max * 1.08;
    let caption = format!("{}, {tool}, {triangles} triangles", plain(method));
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 19))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d(0.0..right, 0.0..most * 1.15)
        .map_err(|e| anyhow!("{e}"))?;
    chart
        .configure_mesh()
        .x_desc("node tests a query")
        .y_desc("queries")
        .disable_x_mesh()
        .x_label_formatter(&|v| number(*v))
        .y_label_formatter(&|v| number(*v))
        .label_style(("sans-serif", 14))
        .light_line_style(WHITE)
        .bold_line_style(RGBColor(225, 225, 225))
        .draw()
        .map_err(|e| anyhow!("{e}"))?;
    let bars = bins.iter().map(|r| {
        let low = 2.0 * r.mean - r.max;
        Rectangle::new([(low, 0.0), (r.max, r.n as f64)], colour(method).filled())
    });
    chart.draw_series(bars).map_err(|e| anyhow!("{e}"))?;
    let marks =
        [("mean", counts.mean, 1.11), ("99 %", counts.p99, 1.04), ("worst", counts.max, 1.11)];
    for (name, at, height) in marks {
        let style = if name == "worst" { RGBColor(213, 94, 0) } else { RGBColor(90, 90, 90) };
        let stroke = style.stroke_width(if name == "worst" { 2 } else { 1 });
        let ends = [(at, 0.0), (at, most * (height - 0.02))];
        chart.draw_series(LineSeries::new(ends, stroke)).map_err(|e| anyhow!("{e}"))?;
        let side = if name == "worst" { HPos::Right } else { HPos::Left };
        let font = ("sans-serif", 13).into_font().color(&style).pos(Pos::new(side, VPos::Center));
        let text = format!(" {name} {at:.0} ");
        chart
            .draw_series([Text::new(text, (at, most * height), font)])
            .map_err(|e| anyhow!("{e}"))?;
    }
    Ok(())
}
