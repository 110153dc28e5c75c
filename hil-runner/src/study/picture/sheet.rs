//! Title, legend and remarks around the plots.

use super::PictureError;
use super::canvas::{Anchor, Area, Canvas, Lettering, with_head};
use super::colour::WHITE;
use super::frame::fold_bold;
use super::legend::{Group, Legend};
use super::text::{LINE, NOTE_PX, TITLE_PX, fold};

/// Width of every picture \[px\].
pub(super) const WIDTH: f64 = 900.0;
/// Room at the edges of the sheet \[px\].
pub(super) const EDGE: f64 = 14.0;

/// All that stands above and below the plots.
pub(super) struct Sheet {
    title: Vec<String>,
    legend: Legend,
    notes: Vec<String>,
}

impl Sheet {
    pub(super) fn new(title: &str, groups: &[Group], notes: &[String]) -> Self {
        let line = WIDTH - 2.0 * EDGE;
        let folded = notes.iter().flat_map(|note| fold(note, NOTE_PX, line));
        Self {
            title: fold_bold(title, TITLE_PX, line),
            legend: Legend::new(groups, line),
            notes: folded.collect(),
        }
    }

    /// Height at which the plots may begin \[px\].
    pub(super) fn top(&self) -> f64 {
        let legend = match self.legend.height {
            0.0 => 0.0,
            height => height + 8.0,
        };
        self.title_bottom() + legend + 8.0
    }

    fn title_bottom(&self) -> f64 {
        EDGE + self.title.len() as f64 * TITLE_PX * LINE + 4.0
    }

    /// Draws a picture whose plots end at `bottom`.
    pub(super) fn draw(
        &self,
        bottom: f64,
        words: &str,
        plots: impl FnOnce(&mut Canvas),
    ) -> Result<String, PictureError> {
        let notes = self.notes.len() as f64 * NOTE_PX * LINE;
        let size = (WIDTH, (bottom + notes + EDGE).ceil());
        let mut svg = String::new();
        let mut canvas = Canvas::new(&mut svg, size);
        canvas.fill(&Area::of([0.0, size.0], [0.0, size.1]), WHITE);
        let lettering = Lettering::of(TITLE_PX, Anchor::Start).bold();
        let pitch = (TITLE_PX * LINE, 0.5);
        canvas.lines(&self.title, (EDGE, EDGE), pitch, &lettering);
        self.legend.draw(&mut canvas, (EDGE, self.title_bottom()));
        plots(&mut canvas);
        let lettering = Lettering::of(NOTE_PX, Anchor::Start).muted();
        let pitch = (NOTE_PX * LINE, 0.5);
        canvas.lines(&self.notes, (EDGE, bottom), pitch, &lettering);
        canvas.finish()?;
        let title = self.title.join(" ");
        Ok(with_head(&svg, size, &title, words))
    }
}
