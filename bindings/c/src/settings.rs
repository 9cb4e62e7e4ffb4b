//! How a sender sends.

use std::time::Duration;

use dibs_stream::Settings;

use crate::code::dibs_code;

/// Settings of a sender. `dibs_sender_settings_of` returns the defaults.
#[derive(Clone, Copy, bytemuck::AnyBitPattern)]
#[repr(C)]
pub struct dibs_sender_settings {
    /// Other than 0 for 6 bytes a vertex instead of 12, in a box that is fitted to each frame.
    pub quantised: u32,
    /// Sends only the vertices that moved by more than this (mm); below 0 every frame is whole.
    pub partial: f32,
    /// With partial frames, the largest number of frames from one whole frame to the next.
    pub whole_every: u32,
    /// Time between two heartbeats, in ms; 0 sends none.
    pub heartbeat: u32,
    /// Session number of this sender. The receiver ignores packets of earlier sessions, whose numbers are smaller, so a
    /// program that restarts needs a larger one. By default the time in tenths of a second.
    pub session: u32,
}

impl TryFrom<dibs_sender_settings> for Settings {
    type Error = dibs_code;

    fn try_from(settings: dibs_sender_settings) -> Result<Self, dibs_code> {
        if !settings.partial.is_finite() {
            return Err(dibs_code::Argument);
        }
        let heartbeat = Duration::from_millis(settings.heartbeat.into());
        Ok(Self {
            quantised: settings.quantised != 0,
            partial: (settings.partial >= 0.0).then_some(settings.partial),
            whole_every: settings.whole_every,
            heartbeat: (settings.heartbeat > 0).then_some(heartbeat),
            session: settings.session,
            ..Self::default()
        })
    }
}

/// The default settings: 6 bytes a vertex, whole frames, a heartbeat every 100 ms.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_settings_of() -> dibs_sender_settings {
    let usual = Settings::default();
    dibs_sender_settings {
        quantised: usual.quantised.into(),
        partial: -1.0,
        whole_every: usual.whole_every,
        heartbeat: usual.heartbeat.map_or(0, |time| time.as_millis() as u32),
        session: usual.session,
    }
}
