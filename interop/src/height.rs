//! Heights as map data writes them. Leaves the choice between tags to the reader.

/// Metres in a foot, by definition.
const METRES_PER_FOOT: f64 = 0.3048;

/// The largest height or number of levels that is believed; the highest building
/// of the world has 828 m and 163 levels.
const LARGEST: f64 = 1000.0;

fn plain(text: &str) -> Option<f64> {
    let n: f64 = text.trim().replace(',', ".").parse().ok()?;
    (n.is_finite() && (0.0..=LARGEST).contains(&n)).then_some(n)
}

/// Metres from `12.13 m`, `12.13`, `12,13m`, `40 ft`, `40'`; `None` when the text
/// is no height.
#[must_use]
pub fn metres(text: &str) -> Option<f64> {
    let t = text.trim();
    for (unit, factor) in [
        ("metres", 1.0),
        ("meters", 1.0),
        ("feet", METRES_PER_FOOT),
        ("ft", METRES_PER_FOOT),
        ("m", 1.0),
        ("'", METRES_PER_FOOT),
    ] {
        if let Some(number) = t.strip_suffix(unit) {
            return plain(number).map(|n| n * factor);
        }
    }
    plain(t)
}

/// Storeys from `5`, `3.5`; `None` when the text is no count.
#[must_use]
pub fn levels(text: &str) -> Option<f64> {
    plain(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_with_and_without_units() {
        let cases = [
            ("18", Some(18.0)),
            ("12.13 m", Some(12.13)),
            ("12,5m", Some(12.5)),
            (" 40 ft ", Some(12.192)),
            ("10'", Some(3.048)),
            ("high", None),
            ("-3", None),
            ("NaN", None),
            ("inf", None),
            ("1e9", None),
            ("", None),
        ];
        for (text, want) in cases {
            let got = metres(text);
            let same = match (got, want) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (None, None) => true,
                _ => false,
            };
            assert!(same, "{text:?}: {got:?}, expected {want:?}");
        }
    }

    #[test]
    fn half_storeys_count() {
        assert_eq!(levels("3.5").map(|n| n * 2.0), Some(7.0));
        assert_eq!(levels("3;4"), None);
    }
}
