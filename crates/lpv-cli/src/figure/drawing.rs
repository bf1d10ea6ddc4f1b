//! From a figure to its drawing.

use super::axis::span;
use super::curve::simplify;
use super::panel::{Mark, Panel};
use super::sheet::Figure;
use super::style::{Dash, STYLE, Style};
use std::fmt::Write;

/// Width of a drawing, and its measures, in pixels.
const WIDTH: f64 = 760.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 46.0;
const LEGEND_ROW: f64 = 20.0;
/// Room between the ends of a curve's data and the frame is cut here; a curve is thinned to this.
const THINNING: f64 = 0.15;

/// Data coordinates to pixels of one panel.
struct Frame {
    x: [f64; 2],
    y: [f64; 2],
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Frame {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.left + (x - self.x[0]) / (self.x[1] - self.x[0]) * self.width,
            self.top + (self.y[1] - y) / (self.y[1] - self.y[0]) * self.height,
        ]
    }
}

impl Figure {
    /// The drawing. With `alone`, a file of its own with its style sheet; otherwise for a page that holds [`STYLE`].
    pub fn svg(&self, alone: bool) -> String {
        draw(self, alone)
    }
}

fn draw(figure: &Figure, alone: bool) -> String {
    let rows = figure.panels.len().div_ceil(figure.columns);
    let cell = WIDTH / figure.columns as f64;
    let width = cell - LEFT - RIGHT;
    let height = (width * figure.aspect).round();
    let (legend, legend_height) = legend(&figure.legend);
    let total = legend_height + rows as f64 * (TOP + height + BOTTOM);
    let id = figure.number.replace('.', "-");
    let heading = match figure.number {
        "" => figure.title.clone(),
        number => format!("Figure {number}: {}", figure.title),
    };

    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"figure-drawing\" viewBox=\"0 0 {WIDTH} {total}\" width=\"{WIDTH}\" \
         height=\"{total}\" role=\"img\" aria-labelledby=\"title-{id} description-{id}\">\n<title id=\"title-{id}\">{}</title>\n\
         <desc id=\"description-{id}\">{}</desc>\n",
        escaped(&heading),
        escaped(&figure.caption)
    );
    if alone {
        let _ = writeln!(svg, "<style>{STYLE}</style>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{total}\"/>");
    }
    svg.push_str(&legend);
    for (k, panel) in figure.panels.iter().enumerate() {
        let left = (k % figure.columns) as f64 * cell + LEFT;
        let top = legend_height + (k / figure.columns) as f64 * (TOP + height + BOTTOM) + TOP;
        let frame = frame(panel, left, top, width, height);
        draw_panel(&mut svg, panel, &frame, &format!("clip-{id}-{k}"));
    }
    svg.push_str("</svg>\n");
    svg
}

fn frame(panel: &Panel, left: f64, top: f64, width: f64, height: f64) -> Frame {
    let values = |axis: usize| panel.marks.iter().flat_map(|mark| &mark.points).map(move |point| point[axis]);
    let mut x = panel.x.range.unwrap_or_else(|| span(values(0)));
    let mut y = panel.y.range.unwrap_or_else(|| span(values(1)));
    if panel.equal {
        let unit = ((x[1] - x[0]) / width).max((y[1] - y[0]) / height);
        let widen = |range: &mut [f64; 2], length: f64| {
            let (middle, half) = (0.5 * (range[0] + range[1]), 0.5 * unit * length);
            *range = [middle - half, middle + half];
        };
        widen(&mut x, width);
        widen(&mut y, height);
    }
    Frame { x, y, left, top, width, height }
}

fn draw_panel(svg: &mut String, panel: &Panel, frame: &Frame, clip: &str) {
    let Frame { left, top, width, height, .. } = *frame;
    let (right, bottom) = (left + width, top + height);
    let _ = writeln!(
        svg,
        "<clipPath id=\"{clip}\"><rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/></clipPath>"
    );
    for (tick, label) in panel.x.ticks(frame.x, (width / 75.0) as usize) {
        let x = round(frame.at([tick, frame.y[0]])[0]);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{x} {top}V{bottom}\"/><text class=\"tick\" text-anchor=\"middle\" x=\"{x}\" y=\"{}\">{label}</text>",
            bottom + 15.0
        );
    }
    for (tick, label) in panel.y.ticks(frame.y, (height / 30.0).max(3.0) as usize) {
        let y = round(frame.at([frame.x[0], tick])[1]);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{left} {y}H{right}\"/><text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{}\">{label}</text>",
            left - 6.0,
            y + 4.0
        );
    }
    let _ = writeln!(svg, "<g clip-path=\"url(#{clip})\">");
    for mark in &panel.marks {
        draw_mark(svg, mark, frame);
    }
    svg.push_str("</g>\n");
    for (point, label) in &panel.labels {
        let [x, y] = frame.at(*point).map(round);
        let _ = writeln!(svg, "<text text-anchor=\"middle\" x=\"{x}\" y=\"{}\">{}</text>", y + 4.0, markup(label));
    }
    for (point, label) in &panel.notes {
        let [x, y] = frame.at(*point).map(round);
        let _ = writeln!(svg, "<text class=\"tick\" x=\"{}\" y=\"{}\">{}</text>", x + 11.0, y + 4.0, markup(label));
    }
    let _ = writeln!(
        svg,
        "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"/>\n\
         <text text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>\n\
         <text text-anchor=\"middle\" transform=\"translate({} {}) rotate(-90)\">{}</text>",
        round(left + 0.5 * width),
        bottom + 34.0,
        markup(&panel.x.label),
        left - 44.0,
        round(top + 0.5 * height),
        markup(&panel.y.label)
    );
    if !panel.title.is_empty() {
        let _ = writeln!(
            svg,
            "<text class=\"panel-title\" x=\"{left}\" y=\"{}\">{}</text>",
            top - 8.0,
            markup(&panel.title)
        );
    }
}

fn draw_mark(svg: &mut String, mark: &Mark, frame: &Frame) {
    let classes = classes(mark.style);
    // a curve that runs away is cut far outside the frame, where it cannot be seen
    let far = 20.0 * WIDTH;
    let pixels = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        points.iter().map(|point| frame.at(*point).map(|v| v.clamp(-far, far))).collect()
    };
    let mut path = String::new();
    for piece in mark.points.split(|point| !(point[0].is_finite() && point[1].is_finite())) {
        let piece = pixels(piece);
        if let Some(sign) = sign(mark.style.dash) {
            for [x, y] in piece {
                let _ = write!(path, "M{:.1} {:.1}{sign}", x, y);
            }
            continue;
        }
        for (k, [x, y]) in simplify(&piece, THINNING).into_iter().enumerate() {
            let _ = write!(path, "{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, x, y);
        }
    }
    if mark.style.dash == Dash::Fill {
        path.push('Z');
    }
    let _ = writeln!(svg, "<path class=\"{classes}\" d=\"{path}\"/>");
}

/// The path of a mark from its middle, of those that are no lines.
fn sign(dash: Dash) -> Option<&'static str> {
    match dash {
        Dash::Dots => Some("h0"),
        Dash::Crosses => Some("m-4 -4l8 8m-8 0l8 -8"),
        Dash::Rings => Some("m-7 0a7 7 0 1 0 14 0a7 7 0 1 0 -14 0"),
        Dash::Solid | Dash::Dashed | Dash::Chain | Dash::Dotted | Dash::Fill => None,
    }
}

fn classes(style: Style) -> String {
    let kind = match style.dash {
        Dash::Solid => "curve",
        Dash::Dashed => "curve dashed",
        Dash::Chain => "curve dash-dotted",
        Dash::Dotted => "curve dotted",
        Dash::Fill => "fill",
        Dash::Dots => "dots",
        Dash::Crosses | Dash::Rings => "sign",
    };
    format!("{kind} s{}", style.color)
}

/// The legend in rows above the panels, and its height.
fn legend(entries: &[(String, Style)]) -> (String, f64) {
    let (mut svg, mut x, mut row) = (String::new(), LEFT, 0);
    for (label, style) in entries {
        let width = 36.0 + 7.2 * escaped(label).chars().count() as f64 + 18.0;
        if x > LEFT && x + width > WIDTH {
            x = LEFT;
            row += 1;
        }
        let y = 14.0 + LEGEND_ROW * f64::from(row);
        let sample = match style.dash {
            Dash::Fill => format!("M{x} {}h28v10h-28Z", y - 9.0),
            Dash::Crosses | Dash::Rings => format!("M{} {}{}", x + 14.0, y - 4.0, sign(style.dash).unwrap_or_default()),
            Dash::Dots => format!("M{} {y2}h0M{} {y2}h0M{} {y2}h0", x + 4.0, x + 14.0, x + 24.0, y2 = y - 4.0),
            _ => format!("M{x} {}h28", y - 4.0),
        };
        let _ = writeln!(
            svg,
            "<path class=\"{}\" d=\"{sample}\"/><text x=\"{}\" y=\"{y}\">{}</text>",
            classes(*style),
            x + 34.0,
            markup(label)
        );
        x += width;
    }
    let height = if entries.is_empty() { 0.0 } else { LEGEND_ROW * f64::from(row + 1) + 4.0 };
    (svg, height)
}

fn round(value: f64) -> f64 {
    (10.0 * value).round() / 10.0
}

/// Text for a page: without markup of its own.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Text in which `_` makes the letters and digits after it an index.
fn markup(text: &str) -> String {
    let text = escaped(text);
    let mut parts = text.split('_');
    let mut result = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_alphanumeric()).unwrap_or(part.len());
        let (index, rest) = part.split_at(end);
        let _ = write!(result, "<tspan dy=\"3\" font-size=\"9\">{index}</tspan><tspan dy=\"-3\">&#8203;{rest}</tspan>");
    }
    result
}
