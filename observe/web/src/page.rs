//! The document: its parts are files of their own, and it is one.

/// The whole page.
pub(crate) const PAGE: &str = concat!(
    include_str!("../page/head.html"),
    "<style>\n",
    include_str!("../page/style.css"),
    "</style>\n",
    include_str!("../page/body.html"),
    "<script>\n\"use strict\";\n",
    include_str!("../page/model.js"),
    include_str!("../page/map.js"),
    include_str!("../page/panels.js"),
    include_str!("../page/history.js"),
    include_str!("../page/charts.js"),
    include_str!("../page/main.js"),
    "</script>\n</body>\n</html>\n",
);

#[cfg(test)]
mod tests {
    use super::PAGE;

    #[test]
    fn the_page_asks_nobody_else_for_anything() {
        for other in ["http:", "https:", "src=", "@import", "url("] {
            let of = PAGE.matches(other).count();
            assert_eq!(of, 0, "{other}");
        }
        // The names of what it asks for.
        assert!(PAGE.contains("\"/stream\"") && PAGE.contains("\"/fault\""));
    }
}
