//! The display of `dibs stream`, while it runs and at the end.

use super::igtl::{Exchange, Report};
use super::timing::Timing;
use dibs_nostd::wire::{Content, Counters, Event, Mac};
use dibs_stream::transport::Line;
use dibs_stream::{Sender, SentFrame};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Progress: one line that is updated on a terminal, elsewhere one line each second.
pub struct Display {
    bar: ProgressBar,
    last: Instant,
}

/// Totals of a stream in addition to the sender's.
#[derive(Default)]
pub struct Outcome {
    /// Number of frames that were sent later than they were due.
    pub late: u64,
    /// Number of live frames that newer ones replaced before they were sent.
    pub passed_over: u64,
    /// Number of times that the connection was made again.
    pub reconnections: u64,
    /// Number of datagrams that were rejected.
    pub refused: u64,
    /// Timing of a live source's frames.
    pub timing: Option<Timing>,
    /// Whether the user ended the stream.
    pub is_interrupted: bool,
}

impl Display {
    pub fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg}") {
            bar.set_style(style);
        }
        Self { bar, last: Instant::now() }
    }

    pub fn show<M: Mac, const MTU: usize>(
        &mut self,
        sender: &Sender<Line, MTU, M>,
        sent: &SentFrame,
    ) {
        let pause = Duration::from_millis(if std::io::stderr().is_terminal() { 100 } else { 1000 });
        if self.last.elapsed() < pause {
            return;
        }
        self.last = Instant::now();
        let text = line(sender, sent);
        if std::io::stderr().is_terminal() {
            self.bar.set_message(text);
            self.bar.tick();
        } else {
            eprintln!("{text}");
        }
    }

    /// Warns that frames are waiting although the receiver reports.
    pub fn warn<M: Mac, const MTU: usize>(&self, sender: &Sender<Line, MTU, M>) {
        let mut text = format!("{} frames are not acknowledged", sender.in_flight());
        text += match sender.status().and_then(|status| status.published) {
            Some(_) => "; the receiver has published others",
            None => "; the receiver has published none",
        };
        let causes = causes(sender.counters());
        if !causes.is_empty() {
            let _ = write!(text, "; it rejected {}", causes.join(", "));
        }
        self.bar.suspend(|| eprintln!("{text}"));
    }

    /// Prints a line above the progress.
    pub fn note(&self, text: &str) {
        self.bar.suspend(|| eprintln!("{text}"));
    }

    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn line<M: Mac, const MTU: usize>(sender: &Sender<Line, MTU, M>, sent: &SentFrame) -> String {
    let kind = match sent.content {
        Content::Whole => "whole, of vertices:",
        Content::Modal => "modal, of weights:",
        _ => "partial, of vertices:",
    };
    let SentFrame { epoch, bytes, rows, .. } = sent;
    let mut text = format!("frame {epoch}: {bytes} bytes, {kind} {rows}");
    text += "; ";
    text += &receiver(sender).map_or("no status from the receiver yet".to_owned(), |it| it.text);
    text
}

/// What the receiver reports; `None` before its first status.
pub fn receiver<M: Mac, const MTU: usize>(sender: &Sender<Line, MTU, M>) -> Option<Report> {
    let status = sender.status()?;
    let mut text = match sender.acknowledged() {
        None => "nothing published yet".to_owned(),
        Some(newest) => {
            let age = status.published.map_or(0, |p| p.age_ms);
            format!("published {newest}, {age} ms old")
        }
    };
    let is_acknowledged = sender.acknowledged().is_some();
    let stretch = status.published.and_then(|p| p.stretch).filter(|_| is_acknowledged);
    if let Some(stretch) = stretch {
        let _ = write!(text, ", stretch {stretch:.3}");
    }
    text += match status.safety {
        1 => ", nominal",
        2 => ", degraded",
        3 => ", SAFE",
        _ => "",
    };
    let rejected = sender.counters().rejected();
    if rejected > 0 {
        let _ = write!(text, "; {rejected} rejected: {}", causes(sender.counters()).join(", "));
    }
    Some(Report { is_ready: is_acknowledged && status.safety != 3, text })
}

/// The causes of rejection that have occurred, with their counts.
fn causes(counters: &Counters) -> Vec<String> {
    Event::ALL
        .into_iter()
        .filter(|&event| event.is_rejection() && counters.of(event) > 0)
        .map(|event| format!("{} {event}", counters.of(event)))
        .collect()
}

/// The totals, as text or JSON.
pub fn totals<M: Mac, const MTU: usize>(
    sender: &Sender<Line, MTU, M>,
    outcome: &Outcome,
    source: Option<&Exchange>,
    json: bool,
) -> String {
    let &Outcome { late, passed_over, reconnections, refused, ref timing, is_interrupted } =
        outcome;
    let totals = sender.totals();
    let per_frame = totals.bytes as f64 / totals.frames.max(1) as f64;
    if json {
        let events: serde_json::Map<String, serde_json::Value> = Event::ALL
            .into_iter()
            .map(|event| (event.name().to_owned(), sender.counters().of(event).into()))
            .collect();
        return format!(
            "{:#}",
            serde_json::json!({
                "frames": totals.frames,
                "partial": totals.partial,
                "packets": totals.packets,
                "bytes": totals.bytes,
                "bytes_per_frame": per_frame,
                "late": late,
                "passed_over": passed_over,
                "reconnections": reconnections,
                "refused": refused,
                "timing": timing.as_ref().map(Timing::json),
                "source": source.map(Exchange::json),
                "interrupted": is_interrupted,
                "statuses": totals.statuses,
                "acknowledged": sender.acknowledged(),
                "events": events,
            })
        );
    }
    let mut lines = vec![format!(
        "sent      {} frames, {} of them partial; {} packets, {per_frame:.0} bytes a frame",
        totals.frames, totals.partial, totals.packets
    )];
    if late > 0 {
        lines.push(format!("late      {late} frames: the line is slower than the motion"));
    }
    if passed_over > 0 {
        lines.push(format!(
            "passed    {passed_over} frames over: newer ones came; --motion-rate sends all of a recording"
        ));
    }
    if let Some(timing) = timing {
        lines.push(format!("timing    {}", timing.text()));
    }
    if let Some(source) = source {
        lines.push(format!("source    {}", source.text()));
    }
    if reconnections > 0 {
        lines.push(format!("line      broke and came back {reconnections} times"));
    }
    if refused > 0 {
        lines.push(format!("refused   {refused} datagrams came back"));
    }
    if is_interrupted {
        lines.push("stopped   by a signal".to_owned());
    }
    if totals.statuses == 0 {
        lines.push("receiver  no status came back".to_owned());
        return lines.join("\n");
    }
    let newest =
        sender.acknowledged().map_or("none of these frames".to_owned(), |n| format!("frame {n}"));
    lines.push(format!("receiver  published {newest} last"));
    lines.push(format!("events    {}", sender.counters()));
    lines.join("\n")
}
