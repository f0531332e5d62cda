//! What keys mean.

use crossterm::event::{Event, KeyCode, KeyEventKind, KeyModifiers};

/// What a person wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wish {
    Quit,
    Pause,
    Faster(isize),
    /// By characters.
    Pan(f64, f64),
    Zoom(f64),
    Fit,
    /// The next UAV, or the one before.
    Select(isize),
    Nobody,
    Links,
    Kill,
    Redraw,
}

/// The wish behind an event of the terminal, if there is one.
pub(crate) fn wish(event: &Event) -> Option<Wish> {
    let key = match event {
        Event::Resize(..) => return Some(Wish::Redraw),
        Event::Key(key) if key.kind != KeyEventKind::Release => key,
        _ => return None,
    };
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        return (key.code == KeyCode::Char('c')).then_some(Wish::Quit);
    }
    Some(match key.code {
        KeyCode::Char('q') => Wish::Quit,
        KeyCode::Char(' ') => Wish::Pause,
        KeyCode::Char(']') => Wish::Faster(1),
        KeyCode::Char('[') => Wish::Faster(-1),
        KeyCode::Char('+' | '=') => Wish::Zoom(1.5),
        KeyCode::Char('-') => Wish::Zoom(1.0 / 1.5),
        KeyCode::Char('0') => Wish::Fit,
        KeyCode::Char('n') | KeyCode::Tab => Wish::Select(1),
        KeyCode::Char('p') | KeyCode::BackTab => Wish::Select(-1),
        KeyCode::Char('l') => Wish::Links,
        KeyCode::Char('K') => Wish::Kill,
        KeyCode::Esc => Wish::Nobody,
        KeyCode::Left => Wish::Pan(-4.0, 0.0),
        KeyCode::Right => Wish::Pan(4.0, 0.0),
        KeyCode::Up => Wish::Pan(0.0, -2.0),
        KeyCode::Down => Wish::Pan(0.0, 2.0),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crossterm::event::KeyEvent;

    #[test]
    fn an_interrupt_quits_and_a_letter_without_meaning_does_nothing() {
        let key = |code, modifiers| wish(&Event::Key(KeyEvent::new(code, modifiers)));
        let plain = KeyModifiers::NONE;
        assert_eq!(
            key(KeyCode::Char('c'), KeyModifiers::CONTROL),
            Some(Wish::Quit)
        );
        assert_eq!(key(KeyCode::Char('c'), plain), None);
        assert_eq!(key(KeyCode::Char('q'), plain), Some(Wish::Quit));
        assert_eq!(
            key(KeyCode::Char('K'), KeyModifiers::SHIFT),
            Some(Wish::Kill)
        );
    }
}
