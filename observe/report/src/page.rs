//! The frame of a page: head, style, tables.

pub(crate) use skein_recording::export::escaped;
use std::fmt::Write as _;

/// Colours follow the reader's, light or dark; on a narrow screen wide drawings scroll by
/// themselves and the page does not.
const STYLE: &str = "
:root{--ink:#1a1d21;--page:#fff;--soft:#667;--line:#d5d8dd;--bad:#c01f1f;--good:#17733a;--zone:#d11}
@media(prefers-color-scheme:dark){:root{--ink:#e3e6ea;--page:#0f1216;--soft:#98a2ae;--line:#343b45;--bad:#ff7b72;--good:#56d364;--zone:#f66}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1080px;padding:16px;background:var(--page);color:var(--ink);font:16px/1.45 system-ui,sans-serif}
h1{font-size:1.5rem;margin:.2em 0}h2{font-size:1.15rem;margin:1.6em 0 .4em;border-bottom:1px solid var(--line)}
.passed{color:var(--good)}.failed{color:var(--bad)}
p.note,figcaption,.soft{color:var(--soft);font-size:.9rem}
figure{margin:.6em 0;overflow-x:auto}figure.plot svg{min-width:620px}
svg{display:block;width:100%;height:auto;font-family:system-ui,sans-serif}
.ink{fill:var(--ink)}.axis{stroke:var(--soft);fill:none}.grid{stroke:var(--line);fill:none}.tick{fill:var(--soft)}
.mark{stroke:var(--ink);fill:none}.bound{stroke:var(--soft);stroke-dasharray:6 4;fill:none}.free{stroke-dasharray:2 3}
.area{fill:none;stroke:var(--ink)}.building{fill:var(--soft);fill-opacity:.22}.zone{fill:var(--zone);fill-opacity:.4;stroke:var(--zone)}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.93rem}
td,th{padding:.25em .8em .25em 0;text-align:left;vertical-align:top;border-bottom:1px solid var(--line)}
th{font-weight:600;white-space:nowrap}td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
code{font:.88rem ui-monospace,monospace;overflow-wrap:anywhere}
.legend span{display:inline-block;margin:0 1em .3em 0;white-space:nowrap}
.legend i{display:inline-block;width:.8em;height:.8em;margin-right:.35em;border-radius:2px}
";

/// A page being written.
#[derive(Debug)]
pub(crate) struct Page(String);

impl Page {
    /// Its head.
    pub(crate) fn new(title: &str) -> Self {
        Self(format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\
             <title>{}</title><style>{STYLE}</style></head><body>\n",
            escaped(title)
        ))
    }

    /// Markup as it is.
    pub(crate) fn raw(&mut self, markup: &str) {
        self.0.push_str(markup);
        self.0.push('\n');
    }

    /// A heading.
    pub(crate) fn heading(&mut self, text: &str) {
        let _ = writeln!(self.0, "<h2>{}</h2>", escaped(text));
    }

    /// A remark.
    pub(crate) fn note(&mut self, text: &str) {
        let _ = writeln!(self.0, "<p class=\"note\">{}</p>", escaped(text));
    }

    /// A drawing that keeps a least width, with a line below it.
    pub(crate) fn plot(&mut self, svg: &str, caption: &str) {
        let caption = escaped(caption);
        let _ = writeln!(
            self.0,
            "<figure class=\"plot\">{svg}<figcaption>{caption}</figcaption></figure>"
        );
    }

    /// A table; cells that are numbers stand to the right.
    pub(crate) fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        self.0.push_str("<div class=\"scroll\"><table>");
        if !head.is_empty() {
            self.0.push_str("<tr>");
            for name in head {
                let _ = write!(self.0, "<th>{}</th>", escaped(name));
            }
            self.0.push_str("</tr>");
        }
        for row in rows {
            self.0.push_str("<tr>");
            for cell in row {
                let class = if is_number(cell) { " class=\"n\"" } else { "" };
                let _ = write!(self.0, "<td{class}>{}</td>", escaped(cell));
            }
            self.0.push_str("</tr>");
        }
        self.0.push_str("</table></div>\n");
    }

    /// The whole of it.
    pub(crate) fn end(mut self) -> String {
        self.0.push_str("</body></html>\n");
        self.0
    }
}

/// Whether a cell is a number, with a unit or without.
fn is_number(cell: &str) -> bool {
    let (number, unit) = cell.split_once(' ').unwrap_or((cell, ""));
    number.parse::<f64>().is_ok() && ["", "s", "m", "%", "times"].contains(&unit)
}

/// Seconds of milliseconds, with one digit.
pub(crate) fn s(ms: u64) -> String {
    format!("{:.1} s", skein_netsim::account::secs(ms))
}

/// The same where it is known.
pub(crate) fn s_of(ms: Option<u64>) -> String {
    ms.map_or_else(|| "–".to_owned(), s)
}
