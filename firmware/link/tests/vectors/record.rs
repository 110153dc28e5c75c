//! Records a file of vectors: an axis from settings, in a loop with a motor. The
//! codes, which drive that motor, are the judge's.

use core::fmt::Write as _;

use firmware::{AxisOutput, AxisState, Inputs, Next};
use firmware_link::vectors::{Given, Settings, Wanted};

use super::judge::Judge;
use crate::rig::Motor;

/// A file that is being written.
pub(crate) struct Recorder {
    text: String,
    settings: Settings,
    running: Option<(AxisState, Judge)>,
    changed: bool,
    pub(crate) motor: Motor,
    pub(crate) tick: u64,
}

impl Recorder {
    /// A file that says in its head what it shows.
    pub(crate) fn about(lines: &str) -> Self {
        let mut text = String::new();
        for line in lines.lines() {
            text.push_str(format!("# {}\n", line.trim()).as_str());
        }
        text.push_str("# The format is in README.md.\n\n");
        Self {
            text,
            settings: Settings::default(),
            running: None,
            changed: true,
            motor: Motor::at(0),
            tick: 0,
        }
    }

    /// Settings, one a line.
    pub(crate) fn set(&mut self, lines: &str) {
        for line in lines.lines().map(str::trim).filter(|line| !line.is_empty()) {
            self.settings
                .set(line)
                .expect("a setting that is known and accepted");
            self.text.push_str(line);
            self.text.push('\n');
        }
        self.changed = true;
    }

    /// One sample with the motor's counter as it is but for `change`.
    pub(crate) fn row(
        &mut self,
        requests: &str,
        next: Next,
        change: impl FnOnce(&mut Inputs),
    ) -> AxisOutput {
        if core::mem::take(&mut self.changed) {
            let axis = self.settings.axis().expect("settings that make an axis");
            self.running = Some(match self.running.take() {
                None => (AxisState::start(&axis), Judge::of(axis)),
                Some((mut state, mut judge)) => {
                    state.change(&axis);
                    judge.change(axis);
                    (state, judge)
                }
            });
            self.text.push('\n');
        }
        let mut inputs = Inputs {
            tick: self.tick,
            motor_register: self.motor.counts().cast_unsigned(),
            ..Inputs::default()
        };
        change(&mut inputs);
        let mut given = Given {
            requests,
            inputs,
            next,
        };
        let (state, judge) = self.running.as_mut().expect("an axis");
        for event in given.events() {
            state.request(event).expect("the state allows it");
        }
        let output = state.tick(&inputs, &mut given);
        let (code, out_of_range) = judge.code(&given, &output);
        let output = AxisOutput {
            code,
            out_of_range,
            ..output
        };
        self.motor.step(output.code);
        self.tick = inputs.tick + 1;
        let wanted = Wanted {
            output,
            fault: state.fault().copied(),
        };
        writeln!(self.text, "{given} | {wanted}").expect("memory");
        output
    }

    /// The file.
    pub(crate) fn into_text(self) -> String {
        self.text
    }
}
