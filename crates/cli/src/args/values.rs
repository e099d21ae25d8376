//! Values of options, checked as they are typed.

use gripgen::tactile::presses::MAX_EDGE_RADIUS_M;
use gripgen::twin::LARGEST_MU;

pub(super) fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().into(), value.trim().into())),
        _ => Err("write it as KEY=VALUE, for example parts.gear.mu=0.2".into()),
    }
}

pub(super) fn scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if mm.is_finite() && mm > 0.0 => Ok(mm),
        Ok(mm) => Err(format!("{mm} mm is no scale, it must be more than 0")),
        Err(_) => Err("a number of millimetres is needed, for example 25.4".into()),
    }
}

pub(super) fn edge_radius(text: &str) -> Result<f64, String> {
    let most_mm = 1e3 * MAX_EDGE_RADIUS_M;
    match text.parse::<f64>() {
        Ok(mm) if (0.0..=most_mm).contains(&mm) => Ok(mm),
        _ => Err(format!("a radius from 0 to {most_mm} mm is needed")),
    }
}

pub(super) fn friction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mu) if mu > 0.0 && mu <= LARGEST_MU => Ok(mu),
        Ok(mu) => Err(format!("{mu} is no friction coefficient, it lies between 0 and {LARGEST_MU}")),
        Err(_) => Err("a friction coefficient is needed, for example 0.3".into()),
    }
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("a number above 0 is wanted".into()),
    }
}

pub(super) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(s) if (0.01..=3600.0).contains(&s) => Ok(s),
        _ => Err("a number of seconds from 0.01 to 3600 is needed".into()),
    }
}

pub(super) fn slice(text: &str) -> Result<(u64, u64), String> {
    let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parsed {
        Some((i, n)) if n > 0 && i <= n => Ok((i, n)),
        Some((i, n)) => {
            Err(format!("piece {i} of {n} does not exist; pieces count from 0 (or from 1) up to {n}"))
        }
        None => Err("write it as I/N, for example 3/8".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_checked_as_they_are_typed() {
        assert_eq!(key_value("a.b = 3"), Ok(("a.b".into(), "3".into())));
        assert!(key_value("nothing").is_err() && key_value("=3").is_err());
        assert_eq!((slice("0/4"), slice("4/4")), (Ok((0, 4)), Ok((4, 4))));
        assert_eq!(scale("25.4"), Ok(25.4));
        assert!(["0", "-1", "nan", "inf", "x"].iter().all(|bad| scale(bad).is_err()));
        assert_eq!(friction("0.3"), Ok(0.3));
        assert!(["0", "-0.3", "5.1", "nan", "x"].iter().all(|bad| friction(bad).is_err()));
        for bad in ["5/4", "1/0", "1", "a/b"] {
            assert!(slice(bad).is_err(), "{bad}");
        }
    }
}
