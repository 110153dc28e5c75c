//! The sheet that everything is drawn on, in pixels with a tenth between.

use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::style::TextStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontDesc, FontFamily, FontStyle, FontTransform, ShapeStyle};

use super::PictureError;
use super::clip::dashes;
use super::colour::{Colour, INK, MUTED};

/// A point \[px\], y downwards.
pub(super) type Point = (f64, f64);

/// Steps of a pixel. The library counts in whole units, and a curve in whole
/// pixels would be a staircase.
const STEPS: f64 = 10.0;

/// The SVG backend writes a font's size divided by this.
const FONT_FACTOR: f64 = 1.24;

/// A rectangle \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    /// The area between two places along x and two along y.
    pub(super) const fn of([left, right]: [f64; 2], [top, bottom]: [f64; 2]) -> Self {
        Self {
            left,
            top,
            right,
            bottom,
        }
    }

    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(super) fn middle(&self) -> Point {
        (
            f64::midpoint(self.left, self.right),
            f64::midpoint(self.top, self.bottom),
        )
    }

    /// True of a point within it or on its edge.
    pub(super) fn holds(&self, (x, y): Point) -> bool {
        // The half step that drawing rounds away.
        let half = 0.5 / STEPS;
        (self.left - half..=self.right + half).contains(&x)
            && (self.top - half..=self.bottom + half).contains(&y)
    }

    /// True if two rectangles share a point.
    pub(super) fn meets(&self, other: &Area) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }
}

/// Colour, width and dashes of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stroke {
    pub(super) colour: Colour,
    pub(super) width_px: f64,
    /// Drawn and left out by turns \[px\]; empty for a solid line.
    pub(super) dash: &'static [f64],
}

impl Stroke {
    pub(super) const fn solid(colour: Colour, width_px: f64) -> Self {
        Self::dashed(colour, width_px, &[])
    }

    pub(super) const fn dashed(colour: Colour, width_px: f64, dash: &'static [f64]) -> Self {
        Self {
            colour,
            width_px,
            dash,
        }
    }
}

/// The part of a text that stands at its point; its middle line always does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Size, place and colour of a text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lettering {
    pub(super) size_px: f64,
    pub(super) anchor: Anchor,
    pub(super) colour: Colour,
    pub(super) bold: bool,
    /// Turned to be read from the right.
    pub(super) upwards: bool,
}

impl Lettering {
    pub(super) const fn of(size_px: f64, anchor: Anchor) -> Self {
        Self {
            size_px,
            anchor,
            colour: INK,
            bold: false,
            upwards: false,
        }
    }

    pub(super) const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub(super) const fn upwards(mut self) -> Self {
        self.upwards = true;
        self
    }

    /// In the colour of what stands beside a plot.
    pub(super) const fn muted(mut self) -> Self {
        self.colour = MUTED;
        self
    }
}

/// A picture while it is drawn.
pub(super) struct Canvas<'a> {
    backend: SVGBackend<'a>,
    /// The first thing that went wrong; nothing is drawn after it.
    fault: Option<PictureError>,
}

impl<'a> Canvas<'a> {
    /// An empty sheet of that size that is written to `svg`.
    pub(super) fn new(svg: &'a mut String, size_px: (f64, f64)) -> Self {
        let (width, height) = units(&size_px);
        let size = (width.unsigned_abs(), height.unsigned_abs());
        Self {
            backend: SVGBackend::with_string(svg, size),
            fault: None,
        }
    }

    fn note<E: std::error::Error>(&mut self, result: Result<(), E>) {
        if let Err(error) = result {
            let fault = PictureError::new(format!("the picture could not be drawn: {error}"));
            self.fault.get_or_insert(fault);
        }
    }

    /// A filled rectangle.
    pub(super) fn fill(&mut self, area: &Area, colour: Colour) {
        let style = ShapeStyle::from(&colour).filled();
        let [from, to] =
            [(area.left, area.top), (area.right, area.bottom)].map(|corner| units(&corner));
        let result = self.backend.draw_rect(from, to, &style, true);
        self.note(result);
    }

    /// A line through these points, dashes and all.
    pub(super) fn path(&mut self, points: &[Point], stroke: &Stroke) {
        if points.len() < 2 {
            return;
        }
        let style = line_style(stroke);
        if stroke.dash.is_empty() {
            let result = self.backend.draw_path(points.iter().map(units), &style);
            return self.note(result);
        }
        for dash in dashes(points, stroke.dash) {
            let result = self.backend.draw_path(dash.iter().map(units), &style);
            self.note(result);
        }
    }

    /// A filled polygon; `share` below 1 lets what is under it through.
    pub(super) fn polygon(&mut self, points: &[Point], colour: Colour, share: f64) {
        let style = ShapeStyle::from(&colour.mix(share)).filled();
        let result = self.backend.fill_polygon(points.iter().map(units), &style);
        self.note(result);
    }

    /// A filled circle.
    pub(super) fn circle(&mut self, centre: Point, radius_px: f64, colour: Colour) {
        let style = ShapeStyle::from(&colour).filled();
        let radius = whole(radius_px).unsigned_abs();
        let centre = units(&centre);
        let result = self.backend.draw_circle(centre, radius, &style, true);
        self.note(result);
    }

    /// The outline of a rectangle.
    pub(super) fn outline(&mut self, area: &Area, stroke: &Stroke) {
        let across = [area.left, area.right, area.right, area.left, area.left];
        let up = [area.top, area.top, area.bottom, area.bottom, area.top];
        let corners: Vec<Point> = across.into_iter().zip(up).collect();
        self.path(&corners, stroke);
    }

    /// A line of text.
    pub(super) fn text(&mut self, text: &str, at: Point, lettering: &Lettering) {
        let style = match lettering.bold {
            true => FontStyle::Bold,
            false => FontStyle::Normal,
        };
        let size = lettering.size_px * STEPS * FONT_FACTOR;
        let mut font = FontDesc::new(FontFamily::SansSerif, size, style);
        if lettering.upwards {
            font = font.transform(FontTransform::Rotate270);
        }
        let h_pos = match lettering.anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let style = TextStyle {
            font,
            color: lettering.colour.to_backend_color(),
            pos: Pos::new(h_pos, VPos::Center),
        };
        let result = self.backend.draw_text(text, &style, units(&at));
        self.note(result);
    }

    /// Lines of text below each other, `pitch_px` apart, the first one `first`
    /// times that below the point.
    pub(super) fn lines(
        &mut self,
        lines: &[String],
        (x, top): Point,
        (pitch_px, first): (f64, f64),
        lettering: &Lettering,
    ) {
        for (line, row) in lines.iter().zip(0_u32..) {
            let y = top + pitch_px * (f64::from(row) + first);
            self.text(line, (x, y), lettering);
        }
    }

    /// Ends the drawing.
    pub(super) fn finish(mut self) -> Result<(), PictureError> {
        let result = self.backend.present();
        self.note(result);
        self.fault.map_or(Ok(()), Err)
    }
}

/// Tenths of a pixel.
// A picture is some 10⁴ steps wide; beyond, the cast holds the ends.
fn whole(px: f64) -> i32 {
    (px * STEPS).round() as i32
}

fn units(&(x, y): &Point) -> (i32, i32) {
    (whole(x), whole(y))
}

fn line_style(stroke: &Stroke) -> ShapeStyle {
    ShapeStyle::from(&stroke.colour).stroke_width(whole(stroke.width_px).unsigned_abs())
}

/// The SVG with a head of our own: its size in pixels over the same units, what
/// it shows in words for those who cannot see it, and round joints.
pub(super) fn with_head(svg: &str, size_px: (f64, f64), title: &str, words: &str) -> String {
    let (width, height) = size_px;
    let body = svg.split_once('\n').map_or(svg, |(_, body)| body);
    // What holds anyway is a quarter of a map; no text has a bare quotation
    // mark, so only attributes are meant.
    let body = body
        .replace(" opacity=\"1\"", "")
        .replace(" stroke=\"none\"", "");
    format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" \
         xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" \
         stroke-linejoin=\"round\">\n<desc>{}</desc>\n{body}",
        whole(width),
        whole(height),
        escaped(title),
        escaped(words),
    )
}

/// A text that may stand in XML.
fn escaped(text: &str) -> String {
    // No XML holds other control characters.
    let text = text.replace(char::is_control, " ").replace('&', "&amp;");
    let text = text.replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}
