//! Clock times and dates in a column that counts seconds.

/// What a cell says of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Clock {
    /// Seconds since midnight: `09:15:30`, `9:15 PM`.
    OfDay(f64),
    /// Seconds since 1970: `2026-05-01 09:15:30`, `2026-05-01T09:15:30Z`, `01.05.2026 09:15`.
    Dated(f64),
}

const DAY_S: f64 = 86_400.0;

impl Clock {
    /// Reads a cell. A date with slashes has two readings, and is none.
    pub(super) fn of(cell: &str) -> Option<Self> {
        let (date, time) = match cell.split_once(['T', ' ']) {
            Some((date, time)) if !date.contains(':') => (Some(date), time),
            _ if cell.contains(':') => (None, cell),
            _ => (Some(cell), "0:00"),
        };
        let Some(date) = date else { return seconds_of_day(time).map(Self::OfDay) };
        let (time, zone_s) = without_zone(time.trim())?;
        Some(Self::Dated(days_since_1970(date)? * DAY_S + seconds_of_day(time)? - zone_s))
    }
}

/// Clocks as seconds from the earliest of them, in their order; times of day go on over midnight. `None` where some have a date
/// and some have none.
pub(super) fn from_the_first(clocks: &[Clock]) -> Option<Vec<f64>> {
    let mut seconds: Vec<f64> = Vec::with_capacity(clocks.len());
    let dated = matches!(clocks.first(), Some(Clock::Dated(_)));
    for clock in clocks {
        seconds.push(match (clock, seconds.last()) {
            (Clock::Dated(s), _) if dated => *s,
            (Clock::OfDay(s), Some(last)) if !dated => {
                // More than half a day back is the next day; less is a row out of order.
                let days = ((last - s) / DAY_S).round().max(0.0);
                s + days * DAY_S
            }
            (Clock::OfDay(s), None) if !dated => *s,
            _ => return None,
        });
    }
    let first = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    Some(seconds.into_iter().map(|s| s - first).collect())
}

/// Whole numbers between marks, as many as asked for.
fn parts<const N: usize>(text: &str, mark: char) -> Option<[u32; N]> {
    let digits = |part: &str| (1..=4).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
    let parts: Option<Vec<u32>> =
        text.split(mark).map(|part| digits(part).then(|| part.parse().ok()).flatten()).collect();
    parts?.try_into().ok()
}

fn days_since_1970(date: &str) -> Option<f64> {
    let (year, month, day) = match (parts::<3>(date, '-').or_else(|| parts(date, '/')), parts(date, '.')) {
        (Some([year, month, day]), _) | (_, Some([day, month, year])) => (year, month, day),
        _ => return None,
    };
    if !(1000..=9999).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    // Days of the Gregorian calendar with years that begin in March, so that the leap day is the last.
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day;
    // Of the first of January 1970.
    Some(f64::from(days) - 719_469.0)
}

fn seconds_of_day(time: &str) -> Option<f64> {
    let upper = time.trim().to_uppercase();
    let half = [("AM", 0), ("PM", 12)].into_iter().find_map(|(end, h)| Some((upper.strip_suffix(end)?, h)));
    let (digits, after_noon) =
        half.map_or((upper.as_str(), None), |(digits, h)| (digits.trim_end(), Some(h)));
    let (clock, fraction) = digits.split_once(['.', ',']).unwrap_or((digits, "0"));
    let [hour, minute, second] = parts::<3>(clock, ':').or_else(|| {
        let [hour, minute] = parts(clock, ':')?;
        Some([hour, minute, 0])
    })?;
    let hour = match after_noon {
        None => hour,
        Some(h) => (1..=12).contains(&hour).then_some(hour % 12 + h)?,
    };
    let fraction: f64 = format!("0.{fraction}").parse().ok()?;
    (hour < 24 && minute < 60 && second < 60)
        .then(|| f64::from(3600 * hour + 60 * minute + second) + fraction)
}

/// A time without its zone, and what the zone is ahead of UTC.
fn without_zone(time: &str) -> Option<(&str, f64)> {
    if let Some(utc) = time.strip_suffix(['Z', 'z']) {
        return Some((utc, 0.0));
    }
    let Some(at) = time.rfind(['+', '-']) else { return Some((time, 0.0)) };
    let zone = &time[at + 1..];
    let [hours, minutes] = match zone.len() {
        2 => [zone.parse().ok()?, 0],
        4 if !zone.contains(':') => [zone.get(..2)?.parse().ok()?, zone.get(2..)?.parse().ok()?],
        _ => parts::<2>(zone, ':')?,
    };
    let ahead_s = f64::from(3600 * hours + 60 * minutes);
    Some((time[..at].trim_end(), if time[at..].starts_with('-') { -ahead_s } else { ahead_s }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_read_as_they_are_written() {
        // `date -u -d @1777626930` is 2026-05-01 09:15:30.
        let at = Clock::Dated(1_777_626_930.0);
        for cell in [
            "2026-05-01T09:15:30Z",
            "2026-05-01 09:15:30",
            "2026/05/01 9:15:30 AM",
            "2026-05-01T11:15:30+02:00",
            "2026-05-01T04:45:30-0430",
            "01.05.2026 09:15:30",
        ] {
            assert_eq!(Clock::of(cell), Some(at), "{cell}");
        }
        assert_eq!(Clock::of("2000-03-01"), Some(Clock::Dated(951_868_800.0)), "behind a leap day");
        assert_eq!(Clock::of("1970-01-01"), Some(Clock::Dated(0.0)));
        for (cell, seconds) in [
            ("09:15:30", 33_330.0),
            ("9:15", 33_300.0),
            ("9:15 PM", 76_500.0),
            ("12:00:00.250 am", 0.25),
            ("0:00:01", 1.0),
        ] {
            assert_eq!(Clock::of(cell), Some(Clock::OfDay(seconds)), "{cell}");
        }
        for cell in
            ["1/5/2026 9:15", "24:00:00", "9:61", "2026-13-01", "a:b", "12-3", ":", "late", "13:00 PM"]
        {
            assert_eq!(Clock::of(cell), None, "{cell}");
        }
    }

    #[test]
    fn times_of_day_go_on_over_midnight() {
        let of =
            |cells: &[&str]| from_the_first(&cells.iter().map(|c| Clock::of(c).unwrap()).collect::<Vec<_>>());
        assert_eq!(of(&["23:59:00", "0:01", "0:02"]), Some(vec![0.0, 120.0, 180.0]));
        assert_eq!(of(&["9:00", "8:59:30", "9:01"]), Some(vec![30.0, 0.0, 90.0]), "a row out of order");
        assert_eq!(of(&["2026-05-01 23:00", "2026-05-02 01:00"]), Some(vec![0.0, 7200.0]));
        assert_eq!(of(&["2026-05-01 23:00", "1:00"]), None);
    }
}
