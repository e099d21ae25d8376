//! Zones around a contact.

/// Where a pixel lies beside the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Zone {
    /// Inside the rim of the contact.
    Contact,
    /// Up to 0.4 radii outside.
    Rim,
    /// From there to 2.2 radii outside: where shadows fall.
    Shadow,
    /// Further away.
    Far,
}

/// All zones, from the contact outwards.
pub const ZONES: [Zone; 4] = [Zone::Contact, Zone::Rim, Zone::Shadow, Zone::Far];

impl Zone {
    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Zone::Contact => "contact",
            Zone::Rim => "rim",
            Zone::Shadow => "shadow zone",
            Zone::Far => "far field",
        }
    }

    /// The zone at a distance from the rim of the contact, in its radii; 0 and less is inside.
    pub(super) fn at(radii_from_rim: f64) -> Zone {
        match radii_from_rim {
            d if d <= 0.0 => Zone::Contact,
            d if d < 0.4 => Zone::Rim,
            d if d < 2.2 => Zone::Shadow,
            _ => Zone::Far,
        }
    }
}
