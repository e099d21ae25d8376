//! Columns that a person is asked for before a pull.

use gripgen::twin::PlannedPull;
use gripgen::twin::columns::notes::{check_note, note_of};
use gripgen::twin::draw::Drawn;
use std::io::BufRead;
use std::sync::mpsc::{Receiver, channel};

/// Asks on standard error and reads a line of standard input, until it can be noted. The answer comes through the
/// channel.
pub fn ask_at_keyboard(place: u64, planned: &PlannedPull, name: &str) -> Receiver<Option<Drawn>> {
    let (tell, answer) = channel();
    let question = format!("pull {}, {} at {} N: {name}?", place + 1, planned.part, planned.grip_force_n);
    let name = name.to_string();
    std::thread::spawn(move || {
        for line in std::iter::once(None).chain(std::io::stdin().lock().lines().map(Some)) {
            let noted = match line {
                None => Err(question.clone()),
                Some(Ok(line)) => noted(&name, &line).map_err(|problem| format!("{problem}. {question}")),
                Some(Err(_)) => return,
            };
            match noted {
                Ok(value) => return drop(tell.send(value)),
                Err(words) => eprintln!("{words}"),
            }
        }
    });
    answer
}

/// What a line notes of a column; nothing where it is empty.
fn noted(name: &str, line: &str) -> Result<Option<Drawn>, String> {
    let value = note_of(line);
    value.as_ref().map_or(Ok(()), |value| check_note(name, value)).map(|()| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_noted_asked_for_again_or_nothing() {
        assert_eq!(noted("temperature_c", "21.5"), Ok(Some(Drawn::Number(21.5))));
        assert_eq!(noted("operator", " anna "), Ok(Some(Drawn::Text("anna".into()))));
        assert_eq!(noted("temperature_c", ""), Ok(None));
        assert!(noted("temperature_c", "21,5").is_err() && noted("humidity_pct", "43,5").is_err());
    }
}
