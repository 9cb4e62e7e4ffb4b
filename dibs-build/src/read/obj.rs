//! Wavefront OBJ: its vertices and faces.
//!
//! Our own reader, because `tobj` renumbers vertices by first use and splits them by group and normal, so a recorded
//! motion would no longer fit. It also has no continued lines, stops at names that are not UTF-8, and reports no line.
//! Tests compare the two.

use super::groups::FaceGroups;
use super::raw::{Raw, excerpt, lines, position};
use super::{Format, ReadErrorKind};

pub(super) fn read(bytes: &[u8], groups: bool) -> Result<Raw, ReadErrorKind> {
    let mut raw = Raw::new(1);
    let mut names = groups.then(Names::default);
    let mut others = Others::default();
    let mut continued = String::new();
    for (number, line) in lines(bytes) {
        let line = line.trim();
        // A comment has no continuation line, since it may end with the backslash of a path.
        if continued.is_empty() && line.starts_with('#') {
            continue;
        }
        if let Some(start) = line.strip_suffix('\\') {
            continued += start;
            continued.push(' ');
            continue;
        }
        if continued.is_empty() {
            statement(line, number, &mut raw, &mut names, &mut others)?;
        } else {
            let line = std::mem::take(&mut continued) + line;
            statement(&line, number, &mut raw, &mut names, &mut others)?;
        }
    }
    if !continued.is_empty() {
        return Err(ReadErrorKind::Truncated {
            format: Format::Obj,
            missing: "its last line is to be continued".to_owned(),
        });
    }
    raw.groups = names.filter(|names| names.were_given).map(|names| names.groups);
    raw.remark(
        others.lines,
        "element was left out: points and lines are no surface",
        "elements were left out: points and lines are no surface",
    );
    raw.remark(
        others.curved,
        "free-form surface was left out: export the mesh as polygons",
        "free-form surfaces were left out: export the mesh as polygons",
    );
    raw.remark(
        others.files,
        "other file that it names by `call` was left out",
        "other files that it names by `call` were left out",
    );
    Ok(raw)
}

/// The groups of faces: one for each combination of a group's and a material's name that occurs.
#[derive(Default)]
struct Names {
    group: String,
    material: String,
    /// The number of the present combination, once a face has it.
    number: Option<f64>,
    were_given: bool,
    groups: FaceGroups,
}

impl Names {
    fn set(&mut self, keyword: &str, name: String) {
        if keyword == "g" {
            self.group = name;
        } else {
            self.material = name;
        }
        (self.number, self.were_given) = (None, true);
    }

    fn push_face(&mut self) {
        let number = self.number.unwrap_or_else(|| {
            let names = [&self.group, &self.material].map(String::as_str);
            let given: Vec<&str> = names.into_iter().filter(|name| !name.is_empty()).collect();
            self.groups.number(&given.join(" / "))
        });
        self.number = Some(number);
        self.groups.of_face.push(number);
    }
}

/// Counts of statements that are left out.
#[derive(Default)]
struct Others {
    lines: usize,
    curved: usize,
    files: usize,
}

fn statement(
    line: &str,
    number: usize,
    raw: &mut Raw,
    names: &mut Option<Names>,
    others: &mut Others,
) -> Result<(), ReadErrorKind> {
    let malformed =
        |what| ReadErrorKind::Malformed { format: Format::Obj, line: Some(number), what };
    let line = line.split_once('#').map_or(line, |(before, _)| before);
    let mut words = line.split_whitespace();
    match words.next() {
        Some("v") => {
            raw.positions.push(position(&mut words, Format::Obj, number)?);
            // One more value is a weight; three or four more are a colour.
            if let (Some(weight), None) = (words.next(), words.next())
                && weight.parse() != Ok(1.0)
            {
                return Err(malformed(format!(
                    "a vertex has the weight '{}', and weights other than 1 are not supported",
                    excerpt(weight)
                )));
            }
        }
        // The format's first version wrote a face as "fo".
        Some("f" | "fo") => {
            let start = raw.corners.len();
            for word in words {
                // vertex/texture/normal
                let vertex = word.split('/').next().unwrap_or_default();
                let Ok(index) = vertex.parse::<i64>() else {
                    return Err(malformed(format!("'{}' is not a vertex number", excerpt(word))));
                };
                // Negative numbers count back from the latest vertex.
                let row = if index < 0 { index + raw.positions.len() as i64 } else { index - 1 };
                raw.corners.push(u32::try_from(row).map_err(|_| raw.bad_index(index))?);
            }
            if raw.corners.len() == start {
                return Err(malformed("a face without vertices".to_owned()));
            }
            raw.end_face();
            if let Some(names) = names {
                names.push_face();
            }
        }
        Some(keyword @ ("g" | "usemtl")) => {
            if let Some(names) = names {
                names.set(keyword, words.collect::<Vec<_>>().join(" "));
            }
        }
        Some("p" | "l") => others.lines += 1,
        Some("surf" | "bzp" | "bsp") => others.curved += 1,
        Some("call") => others.files += 1,
        _ => {}
    }
    Ok(())
}
