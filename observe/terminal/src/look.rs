//! Colours and characters, as far as the terminal has them.

use ratatui::style::{Color, Modifier, Style};

/// What the terminal can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Blocks and arrows, not ASCII alone.
    pub unicode: bool,
    /// Colours.
    pub colour: bool,
}

/// Safe for people who confuse colours (Okabe and Ito), as near as 256 colours come; the same
/// order as on the page.
const PALETTE: [u8; 7] = [25, 214, 36, 175, 74, 166, 142];

impl Look {
    /// By the environment: `NO_COLOR` takes colours away, a locale without UTF-8 the blocks.
    #[must_use]
    pub fn of_environment() -> Self {
        let var = |name: &str| std::env::var(name).ok().filter(|v| !v.is_empty());
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].iter().find_map(|n| var(n));
        Self::of(
            locale.as_deref(),
            var("NO_COLOR").is_some(),
            var("TERM").as_deref(),
        )
    }

    fn of(locale: Option<&str>, no_color: bool, term: Option<&str>) -> Self {
        let utf8 = |l: &str| {
            let l = l.to_ascii_lowercase();
            l.contains("utf-8") || l.contains("utf8")
        };
        Self {
            unicode: locale.is_some_and(utf8) && term != Some("linux"),
            colour: !no_color && term.is_some_and(|t| !t.starts_with("vt")),
        }
    }

    /// The colour of a peer.
    #[must_use]
    pub fn of_peer(self, id: u16) -> Style {
        let nth = usize::from(id.saturating_sub(1)) % PALETTE.len();
        self.colour(Color::Indexed(PALETTE[nth]))
    }

    /// Something bad.
    #[must_use]
    pub fn bad(self) -> Style {
        self.colour(Color::Indexed(160))
            .add_modifier(Modifier::BOLD)
    }

    /// Something in the background.
    #[must_use]
    pub fn dim(self) -> Style {
        Style::new().add_modifier(Modifier::DIM)
    }

    fn colour(self, colour: Color) -> Style {
        if self.colour {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    /// A cell that was seen.
    pub(crate) fn covered(self) -> char {
        if self.unicode { '█' } else { '#' }
    }

    /// A cell that somebody lists: without colours its owner's last digit tells whose.
    pub(crate) fn planned(self, owner: u16) -> char {
        match (self.colour, self.unicode) {
            (true, true) => '░',
            (true, false) => ':',
            (false, _) => char::from(b'0' + u8::try_from(owner % 10).unwrap_or(0)),
        }
    }

    /// A cell whose owner is gone.
    pub(crate) fn orphan(self) -> char {
        if self.unicode { '▚' } else { '?' }
    }

    /// A no-fly zone.
    pub(crate) fn zone(self) -> char {
        if self.unicode { '╳' } else { 'X' }
    }

    /// A building.
    pub(crate) fn building(self) -> char {
        if self.unicode { '▫' } else { ',' }
    }

    /// A link between two peers.
    pub(crate) fn link(self) -> char {
        if self.unicode { '·' } else { '.' }
    }

    /// A UAV that heads there, degrees clockwise from north.
    pub(crate) fn heading(self, deg: f64) -> char {
        const ARROWS: [char; 8] = ['↑', '↗', '→', '↘', '↓', '↙', '←', '↖'];
        const ASCII: [char; 8] = ['^', '/', '>', '\\', 'v', '/', '<', '\\'];
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 8 after the remainder"
        )]
        let nth = ((deg.rem_euclid(360.0) / 45.0).round() as usize) % 8;
        if self.unicode {
            ARROWS[nth]
        } else {
            ASCII[nth]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_says_what_is_shown() {
        let look = |locale, no_color, term| {
            let Look { unicode, colour } = Look::of(locale, no_color, term);
            (unicode, colour)
        };
        assert_eq!(
            look(Some("de_DE.UTF-8"), false, Some("xterm")),
            (true, true)
        );
        assert_eq!(look(Some("C"), false, Some("xterm")), (false, true));
        assert_eq!(look(Some("C.utf8"), true, Some("xterm")), (true, false));
        assert_eq!(look(None, false, Some("vt100")), (false, false));
        assert_eq!(look(None, false, None), (false, false));
    }

    #[test]
    fn headings_turn_clockwise_from_north() {
        let look = Look {
            unicode: true,
            colour: true,
        };
        let told: String = [0.0, 44.0, 90.0, 180.0, 269.0, 359.0, -90.0]
            .map(|deg| look.heading(deg))
            .iter()
            .collect();
        assert_eq!(told, "↑↗→↓←↑←");
    }
}
