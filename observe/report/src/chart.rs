//! Axes and scales of a plot.

use crate::page::escaped;
use std::fmt::Write as _;

/// Width of every drawing, in its own units.
pub(crate) const WIDTH: f64 = 960.0;
/// Room left of the plot, for the numbers of its axis.
pub(crate) const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 34.0;

/// A plot being drawn.
#[derive(Debug)]
pub(crate) struct Chart {
    svg: String,
    height: f64,
    x_max: f64,
    y_max: f64,
}

impl Chart {
    /// With its horizontal axis from 0 to `x_max` and its vertical one to `y_max`; what is not
    /// above 0 counts as 1.
    pub(crate) fn new(height: f64, x_max: f64, y_max: f64, title: &str) -> Self {
        let svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" font-size=\"14\" role=\"img\" aria-label=\"{}\">",
            escaped(title)
        );
        let positive = |x: f64| if x > 0.0 { x } else { 1.0 };
        Self {
            svg,
            height,
            x_max: positive(x_max),
            y_max: positive(y_max),
        }
    }

    pub(crate) fn x(&self, value: f64) -> f64 {
        LEFT + (WIDTH - LEFT - RIGHT) * (value / self.x_max).clamp(0.0, 1.0)
    }

    pub(crate) fn y(&self, value: f64) -> f64 {
        let span = self.height - TOP - BOTTOM;
        self.height - BOTTOM - span * (value / self.y_max).clamp(0.0, 1.0)
    }

    /// Markup as it is.
    pub(crate) fn raw(&mut self, markup: &str) {
        self.svg.push_str(markup);
    }

    /// Text at a place of the drawing, anchored `start`, `middle` or `end`.
    pub(crate) fn text(&mut self, (x, y): (f64, f64), anchor: &str, class: &str, text: &str) {
        let _ = write!(
            self.svg,
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
            escaped(text)
        );
    }

    /// The horizontal axis with its numbers.
    pub(crate) fn x_axis(&mut self, unit: &str) {
        let y = self.y(0.0);
        let (from, to) = (self.x(0.0), self.x(self.x_max));
        let _ = write!(
            self.svg,
            "<path class=\"axis\" d=\"M{from:.1} {y:.1}H{to:.1}\"/>"
        );
        let step = step(self.x_max, 8.0);
        let mut at = 0.0;
        while at <= self.x_max * 1.0001 {
            let x = self.x(at);
            self.text((x, y + 18.0), "middle", "tick", &number(at));
            at += step;
        }
        self.text((to, y + 32.0), "end", "tick", unit);
    }

    /// Lines across, with their numbers.
    pub(crate) fn y_axis(&mut self, unit: &str, most: f64) {
        let step = step(self.y_max, most);
        let mut at = 0.0;
        while at <= self.y_max * 1.0001 {
            let (y, from, to) = (self.y(at), self.x(0.0), self.x(self.x_max));
            let _ = write!(
                self.svg,
                "<path class=\"grid\" d=\"M{from:.1} {y:.1}H{to:.1}\"/>"
            );
            let label = format!("{}{unit}", number(at));
            self.text((LEFT - 8.0, y + 5.0), "end", "tick", &label);
            at += step;
        }
    }

    /// A line upright, with a word at its top.
    pub(crate) fn upright(&mut self, at: f64, class: &str, word: &str) {
        let (x, low, high) = (self.x(at), self.y(0.0), self.y(self.y_max));
        let _ = write!(
            self.svg,
            "<path class=\"{class}\" d=\"M{x:.1} {low:.1}V{high:.1}\"/>"
        );
        if !word.is_empty() {
            let (anchor, x) = if x > WIDTH * 0.8 {
                ("end", x - 5.0)
            } else {
                ("start", x + 5.0)
            };
            self.text((x, high + 14.0), anchor, "tick", word);
        }
    }

    /// A path through points.
    pub(crate) fn line(&self, points: &[(f64, f64)]) -> String {
        let mut d = String::new();
        let mut last = String::new();
        for (i, (x, y)) in points.iter().enumerate() {
            let at = format!("{:.1} {:.1}", self.x(*x), self.y(*y));
            if at != last {
                let _ = write!(d, "{}{at}", if i == 0 { 'M' } else { 'L' });
                last = at;
            }
        }
        d
    }

    /// The drawing.
    pub(crate) fn end(mut self) -> String {
        self.svg.push_str("</svg>");
        self.svg
    }
}

/// A round step that divides a span into at most so many.
pub(crate) fn step(span: f64, most: f64) -> f64 {
    let raw = span / most.max(1.0);
    let power = 10f64.powf(raw.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let fits = steps.iter().find(|s| *s * power >= raw * 0.9999);
    fits.unwrap_or(&10.0) * power
}

/// A number without digits that say nothing.
fn number(x: f64) -> String {
    if (x - x.round()).abs() < 1e-9 {
        format!("{x:.0}")
    } else {
        let text = format!("{x:.3}");
        text.trim_end_matches('0').to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for (span, most, expected) in [(403.0, 8.0, 100.0), (1.0, 5.0, 0.2), (7.0, 8.0, 1.0)] {
            assert!((step(span, most) - expected).abs() < 1e-12, "{span}");
        }
        for n in 1..2000 {
            let span = f64::from(n) * 0.37;
            let step = step(span, 8.0);
            assert!(span / step <= 8.001 && span / step > 2.5, "{span} {step}");
        }
    }

    #[test]
    fn values_beyond_the_axes_stay_on_the_drawing() {
        let chart = Chart::new(200.0, 0.0, f64::NAN, "nothing");
        assert!(chart.x(1e9) <= WIDTH && chart.y(5.0) >= 0.0);
    }
}
