//! A push button without its bounces.

/// Samples that a level must last: 20 ms at 1 ms, longer than any bounce of
/// the small buttons on such boards.
const STEADY_SAMPLES: u8 = 20;

/// Finds the presses in the samples of a button.
///
/// One that is down when the program starts, or stuck, gives none: it must be
/// up first.
///
/// ```
/// use stm32f407_drive::Button;
///
/// let mut button = Button::default();
/// let mut presses = |down, samples| (0..samples).filter(|_| button.pressed(down)).count();
/// assert_eq!(presses(true, 100), 0);
/// assert_eq!(presses(false, 20), 0);
/// assert_eq!(presses(true, 19), 0);
/// assert_eq!(presses(true, 100), 1);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Button {
    down: bool,
    /// Samples in a row with the other level.
    other: u8,
}

impl Default for Button {
    fn default() -> Self {
        Self {
            down: true,
            other: 0,
        }
    }
}

impl Button {
    /// One sample of the level; whether a press begins with it.
    pub fn pressed(&mut self, down: bool) -> bool {
        if down == self.down {
            self.other = 0;
            return false;
        }
        self.other = self.other.saturating_add(1);
        if self.other < STEADY_SAMPLES {
            return false;
        }
        self.other = 0;
        self.down = down;
        down
    }
}
