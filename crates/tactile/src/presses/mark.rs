//! Marks that can be: where a ball touches, checked against the image and the ball.

use super::{Circle, Contact, Press};

/// Hand-drawn circles are unsure by a few per cent: one up to so much wider than the ball is taken for its equator.
const WIDEST: f64 = 1.05;

/// Why a mark cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MarkError {
    /// Nobody marked the contact, and none is to be seen.
    #[error("press `{press}` has no centre and radius, and no contact is to be seen in it")]
    Missing {
        /// The press.
        press: String,
    },
    /// A contact whose centre lies beside the image.
    #[error("press `{press}`: the centre ({x_px}, {y_px}) lies outside the {width_px}x{height_px} image")]
    Outside {
        /// The press.
        press: String,
        /// Centre, along the columns.
        x_px: f64,
        /// Centre, down the rows.
        y_px: f64,
        /// Width of the image.
        width_px: u32,
        /// Height of the image.
        height_px: u32,
    },
    /// A contact wider than the ball, or without width.
    #[error("press `{press}`: the radius is {radius_mm:.3} mm, the ball's {ball_mm:.3} mm")]
    Radius {
        /// The press.
        press: String,
        /// Radius of the contact.
        radius_mm: f64,
        /// Radius of the ball.
        ball_mm: f64,
    },
}

/// A press with its checked contact.
pub(super) type Marked<'a> = (&'a Press, Contact);

/// The contact of a press; the circle of a ball is at most as wide as the ball.
pub(super) fn checked(press: &Press, ball_m: f64, metres_per_px: f64) -> Result<Contact, MarkError> {
    if let (Some(_), Some(circle)) = (&press.indenter, press.circle) {
        return Ok(Contact::of_press(press, circle));
    }
    let name = || press.name.clone();
    let circle = press.circle.ok_or_else(|| MarkError::Missing { press: name() })?;
    let (width_px, height_px) = (press.image.width_px, press.image.height_px);
    let inside = |v: f64, n: u32| (-0.5..=f64::from(n) - 0.5).contains(&v);
    if !inside(circle.x_px, width_px) || !inside(circle.y_px, height_px) {
        let (x_px, y_px) = (circle.x_px, circle.y_px);
        return Err(MarkError::Outside { press: name(), x_px, y_px, width_px, height_px });
    }
    let ball_px = ball_m / 2.0 / metres_per_px;
    if !(circle.radius_px > 0.0 && circle.radius_px <= WIDEST * ball_px) {
        let radius_mm = circle.radius_px * metres_per_px * 1e3;
        return Err(MarkError::Radius { press: name(), radius_mm, ball_mm: ball_m / 2.0 * 1e3 });
    }
    let circle = Circle { radius_px: circle.radius_px.min(0.999 * ball_px), ..circle };
    Ok(Contact::of_press(press, circle))
}
