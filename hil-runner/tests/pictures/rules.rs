//! Rules that hold for every picture, and a proof that each can be broken.

use super::samples::{all, draw_sample};
use super::sheet::{Box, Sheet, Text};

/// Smallest letters [px].
const LEAST_PX: f64 = 13.0;

/// Everything that is wrong with a picture, whatever it shows.
fn wrong(svg: &str) -> Vec<String> {
    let sheet = match Sheet::read(svg) {
        Ok(sheet) => sheet,
        Err(error) => return vec![error],
    };
    let mut wrong = Vec::new();
    let whole = Box::new(0.0, 0.0, sheet.width_px, sheet.height_px);
    let within =
        |room: &Box| whole.holds((room.left, room.top)) && whole.holds((room.right, room.bottom));
    let plots = sheet.plots();
    let first_plot = plots.iter().map(|plot| plot.top).fold(f64::NAN, f64::min);
    let shown = |point: (f64, f64)| {
        // Above the plots stands the legend.
        point.1 < first_plot || plots.iter().any(|plot| plot.holds(point))
    };
    for text in &sheet.texts {
        if text.size_px < LEAST_PX {
            wrong.push(format!("small: {text:?}"));
        }
        if !within(&text.room) {
            wrong.push(format!("off the sheet: {text:?}"));
        }
        if text.words.starts_with('-') || text.words.is_empty() {
            wrong.push(format!("no minus or no words: {text:?}"));
        }
    }
    for (at, text) in sheet.texts.iter().enumerate() {
        let covered = |other: &&Text| other.room.meets(&text.room);
        if let Some(other) = sheet.texts[..at].iter().find(covered) {
            wrong.push(format!("{:?} lies on {:?}", text.words, other.words));
        }
    }
    for form in &sheet.forms {
        if !within(&form.room) {
            wrong.push(format!("off the sheet: {form:?}"));
        }
        if form.tag != "rect" && !shown(form.middle) {
            wrong.push(format!("a mark beside the plot: {form:?}"));
        }
    }
    // Axes and the frame of the colour bar lie on the edge or beside it.
    let beside = |stroke: &str| stroke == "#5C646D";
    for line in sheet.lines.iter().filter(|line| !beside(&line.stroke)) {
        if let Some(point) = line.points.iter().find(|point| !shown(**point)) {
            wrong.push(format!("a line beside the plot at {point:?}: {line:?}"));
        }
    }
    if plots.is_empty() {
        wrong.push("no plot".into());
    }
    wrong
}

#[test]
fn every_sample_is_right() {
    for sample in all() {
        let svg = draw_sample(&sample);
        let wrong = wrong(&svg);
        assert!(wrong.is_empty(), "{}:\n{}", sample.name, wrong.join("\n"));
    }
}

/// The contrast: each rule is broken by a picture made wrong in one place.
#[test]
fn the_rules_can_be_broken() {
    let sample = &all()[0];
    let svg = draw_sample(sample);
    assert!(wrong(&svg).is_empty());
    let plot = Sheet::read(&svg).unwrap().plots()[0];
    let text = |x: f64, y: f64, size: f64, words: &str| {
        format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"start\" fill=\"#000000\">\
             {words}</text>"
        )
    };
    let below = format!("{}", 10.0 * (plot.bottom + 5.0));
    for (broken, report) in [
        (text(5.0, 5.0, 140.0, "off"), "off the sheet"),
        (text(4000.0, 2500.0, 100.0, "tiny"), "small"),
        (text(4000.0, 2500.0, 140.0, "-3"), "no minus"),
        (text(200.0, 250.0, 140.0, "over the title"), "lies on"),
        (
            format!("<circle cx=\"4000\" cy=\"{below}\" r=\"40\" opacity=\"1\" fill=\"#000000\"/>"),
            "a mark beside the plot",
        ),
        (
            format!(
                "<polyline stroke=\"#0072B2\" stroke-width=\"20\" points=\"4000,2500 4000,{below}\"/>"
            ),
            "a line beside the plot",
        ),
        (
            "<circle cx=\"NaN\" cy=\"1\" r=\"40\" opacity=\"1\"/>".into(),
            "cx is NaN",
        ),
        ("<g>".into(), "expected 'g' tag"),
    ] {
        let svg = svg.replace("</svg>", &format!("{broken}</svg>"));
        let wrong = wrong(&svg);
        let found = wrong.iter().any(|line| line.contains(report));
        assert!(found, "{report}: {wrong:?}");
    }
    let framed = svg.replace("#5C646D", "#000000");
    assert!(wrong(&framed).contains(&"no plot".to_owned()));
}

/// Same table, same bytes; another value, others.
#[test]
fn pictures_are_deterministic() {
    for sample in all() {
        let same = draw_sample(&sample) == draw_sample(&sample);
        assert!(same, "{}", sample.name);
    }
    let mut other = all().swap_remove(0);
    let before = draw_sample(&other);
    other.change_a_number();
    assert!(draw_sample(&other) != before);
}

/// The order of rows does not matter where there are numbers only.
#[test]
fn the_order_of_rows_does_not_matter() {
    for mut sample in all() {
        if sample.has_words() {
            continue;
        }
        let before = draw_sample(&sample);
        sample.turn_rows_round();
        assert!(draw_sample(&sample) == before, "{}", sample.name);
    }
}

/// Text stands out from white with 4.5 to 1 (WCAG 1.4.3), wherever it stands on
/// white; the contrast is the grey of the grid.
#[test]
fn text_can_be_read() {
    for sample in all() {
        let sheet = Sheet::read(&draw_sample(&sample)).unwrap();
        for text in &sheet.texts {
            let ground = sheet.forms.iter().rfind(|form| {
                form.tag == "rect" && form.opacity == 1.0 && form.room.holds(text.at)
            });
            let ground = ground.map_or("#FFFFFF", |form| &form.fill);
            let contrast = contrast(&text.fill, ground);
            assert!(contrast >= 4.5, "{}: {text:?} on {ground}", sample.name);
        }
    }
    assert!(contrast("#DDE1E5", "#FFFFFF") < 4.5);
}

fn contrast(a: &str, b: &str) -> f64 {
    let luminance = |colour: &str| {
        let part = |from: usize| {
            let byte = u8::from_str_radix(&colour[from..from + 2], 16).unwrap();
            let part = f64::from(byte) / 255.0;
            if part <= 0.03928 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}
