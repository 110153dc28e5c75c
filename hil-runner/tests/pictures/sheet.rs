//! An SVG as a reader sees it: texts, marks, lines, plots.

use roxmltree::{Document, Node};

/// Units of the sheet per pixel.
pub(super) const STEPS: f64 = 10.0;

/// A rectangle [px].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Box {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Box {
    pub(super) fn new(left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self {
            left,
            top,
            right,
            bottom,
        }
    }

    pub(super) fn holds(&self, (x, y): (f64, f64)) -> bool {
        let slack = 0.11;
        x >= self.left - slack
            && x <= self.right + slack
            && y >= self.top - slack
            && y <= self.bottom + slack
    }

    pub(super) fn meets(&self, other: &Self) -> bool {
        self.left < other.right
            && other.left < self.right
            && self.top < other.bottom
            && other.top < self.bottom
    }
}

/// A text with the room that it takes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Text {
    pub(super) words: String,
    pub(super) size_px: f64,
    pub(super) at: (f64, f64),
    pub(super) room: Box,
    pub(super) upwards: bool,
    pub(super) fill: String,
}

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    pub(super) points: Vec<(f64, f64)>,
    pub(super) stroke: String,
    pub(super) width_px: f64,
}

/// A filled form: circle, polygon or rectangle, by its middle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Form {
    pub(super) tag: String,
    pub(super) middle: (f64, f64),
    pub(super) room: Box,
    pub(super) fill: String,
    pub(super) opacity: f64,
}

/// All that an SVG shows.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    pub(super) width_px: f64,
    pub(super) height_px: f64,
    pub(super) texts: Vec<Text>,
    pub(super) lines: Vec<Line>,
    pub(super) forms: Vec<Form>,
}

impl Sheet {
    /// Reads an SVG; not well-formed XML, numbers that are none, and elements
    /// that a picture does not have are errors.
    pub(super) fn read(svg: &str) -> Result<Self, String> {
        let document = Document::parse(svg).map_err(|error| error.to_string())?;
        let root = document.root_element();
        let mut sheet = Self {
            width_px: number(&root, "width")?,
            height_px: number(&root, "height")?,
            texts: Vec::new(),
            lines: Vec::new(),
            forms: Vec::new(),
        };
        let units = [sheet.width_px, sheet.height_px].map(|px| px * STEPS);
        let view = format!("0 0 {} {}", units[0], units[1]);
        if root.attribute("viewBox") != Some(&view) {
            return Err(format!("viewBox is {:?}", root.attribute("viewBox")));
        }
        for node in root.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "desc" => {}
                "text" => sheet.texts.push(text(&node)?),
                "polyline" => sheet.lines.push(line(&node)?),
                "rect" | "circle" | "polygon" => sheet.forms.push(form(&node)?),
                other => return Err(format!("<{other}>")),
            }
        }
        Ok(sheet)
    }

    /// The plots: frames in the colour of axes.
    pub(super) fn plots(&self) -> Vec<Box> {
        let frames = self.lines.iter().filter(|line| {
            line.points.len() == 5
                && line.points.first() == line.points.last()
                && line.stroke == "#5C646D"
                && line.width_px == 1.2
        });
        // The colour bar is a frame too, but narrow.
        let frames = frames.map(|line| room(&line.points));
        frames
            .filter(|frame| frame.right - frame.left > 50.0)
            .collect()
    }

    pub(super) fn has(&self, words: &str) -> bool {
        self.texts.iter().any(|text| text.words == words)
    }

    pub(super) fn find(&self, words: &str) -> &Text {
        let found = self.texts.iter().find(|text| text.words == words);
        found.unwrap_or_else(|| panic!("no {words:?} in {:?}", self.words()))
    }

    pub(super) fn words(&self) -> Vec<&str> {
        self.texts.iter().map(|text| text.words.as_str()).collect()
    }

    /// Circles within a plot: the marks of a first series.
    pub(super) fn circles(&self, plot: &Box) -> Vec<(f64, f64)> {
        let circles = self.forms.iter().filter(|form| form.tag == "circle");
        let middles = circles.map(|form| form.middle);
        middles.filter(|&middle| plot.holds(middle)).collect()
    }
}

fn number(node: &Node, name: &str) -> Result<f64, String> {
    let text = node.attribute(name).unwrap_or("nothing");
    let value: f64 = text.parse().map_err(|_| format!("{name} is {text}"))?;
    let finite = value.is_finite().then_some(value);
    finite.ok_or_else(|| format!("{name} is {text}"))
}

fn px(node: &Node, name: &str) -> Result<f64, String> {
    Ok(number(node, name)? / STEPS)
}

fn attribute(node: &Node, name: &str) -> String {
    node.attribute(name).unwrap_or_default().to_owned()
}

fn points(node: &Node) -> Result<Vec<(f64, f64)>, String> {
    let point = |pair: &str| {
        let (x, y) = pair.split_once(',')?;
        let px = |text: &str| Some(text.parse::<f64>().ok()? / STEPS);
        Some((px(x)?, px(y)?))
    };
    let pairs = node.attribute("points").unwrap_or_default();
    let points: Option<Vec<_>> = pairs.split_whitespace().map(point).collect();
    points.ok_or_else(|| format!("points are {pairs}"))
}

fn room(points: &[(f64, f64)]) -> Box {
    let (most, least) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut room = Box::new(most, most, least, least);
    for &(x, y) in points {
        room.left = room.left.min(x);
        room.right = room.right.max(x);
        room.top = room.top.min(y);
        room.bottom = room.bottom.max(y);
    }
    room
}

/// Width of a letter of running text, about, in Liberation Sans.
const LETTER_EM: f64 = 0.5;
/// Height of letters from the foot of p to the top of d, a little less.
const HEIGHT_EM: f64 = 0.9;

fn text(node: &Node) -> Result<Text, String> {
    let words = node.text().unwrap_or_default().trim().to_owned();
    let at = (px(node, "x")?, px(node, "y")?);
    let size_px = px(node, "font-size")?;
    let upwards = node.attribute("transform").is_some();
    let length = LETTER_EM * size_px * words.chars().count() as f64;
    let before = match node.attribute("text-anchor") {
        Some("start") => 0.0,
        Some("middle") => 0.5,
        Some("end") => 1.0,
        other => return Err(format!("text-anchor is {other:?}")),
    };
    let half = 0.5 * HEIGHT_EM * size_px;
    let room = if upwards {
        let bottom = at.1 + before * length;
        Box::new(at.0 - half, bottom - length, at.0 + half, bottom)
    } else {
        let left = at.0 - before * length;
        Box::new(left, at.1 - half, left + length, at.1 + half)
    };
    Ok(Text {
        words,
        size_px,
        at,
        room,
        upwards,
        fill: attribute(node, "fill"),
    })
}

fn line(node: &Node) -> Result<Line, String> {
    Ok(Line {
        points: points(node)?,
        stroke: attribute(node, "stroke"),
        width_px: px(node, "stroke-width")?,
    })
}

fn form(node: &Node) -> Result<Form, String> {
    let room = match node.tag_name().name() {
        "rect" => {
            let (left, top) = (px(node, "x")?, px(node, "y")?);
            let (width, height) = (px(node, "width")?, px(node, "height")?);
            Box::new(left, top, left + width, top + height)
        }
        "circle" => {
            let (x, y, r) = (px(node, "cx")?, px(node, "cy")?, px(node, "r")?);
            Box::new(x - r, y - r, x + r, y + r)
        }
        _ => room(&points(node)?),
    };
    let middle = (
        0.5 * (room.left + room.right),
        0.5 * (room.top + room.bottom),
    );
    Ok(Form {
        tag: node.tag_name().name().to_owned(),
        middle,
        room,
        fill: attribute(node, "fill"),
        opacity: node
            .attribute("opacity")
            .map_or(Ok(1.0), |_| number(node, "opacity"))?,
    })
}
