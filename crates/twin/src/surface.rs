//! Surfaces: a dependence of friction on several columns together that was measured and has no name.
//!
//! A diagnosis adds one to the twin where columns act together in a way that no effect and no curve of one column describes. Like a
//! [table](crate::table) it repeats what was seen and is marked `physical = false`. Far from all its points the factor is 1.

use crate::columns::{self, Column, PullView};
use crate::config::{ConfigError, TwinFile, in_range};
use crate::draw::Drawn;
use crate::table::{list, numbers};

/// The `name` of a surface among the effects of a twin file. It is not in the library.
pub const SURFACE_EFFECT: &str = "surface";

/// One column of a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceAxis {
    /// A column of a pull table, in its units, or one of unknown meaning.
    pub column: String,
    /// Distance at which two points are alike by a factor of exp(-1/2); two different words have the distance 1.
    pub length: f64,
    /// Whether the column counts by its natural logarithm.
    pub logarithm: bool,
}

/// Factor on friction over several columns:
/// log factor = sum over points k of `weight_k` exp(-1/2 sum over columns d of (x_d - p_kd)^2 / `length_d`^2).
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Its columns.
    pub axes: Vec<SurfaceAxis>,
    /// Points, each with one value for each column.
    pub points: Vec<Vec<Drawn>>,
    /// One weight for each point.
    pub weights: Vec<f64>,
}

impl Surface {
    /// The columns that it depends on.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.axes.iter().map(|axis| axis.column.as_str())
    }

    /// The factor at a pull; 1 where a column of it has no value.
    pub fn factor(&self, pull: PullView<'_>) -> f64 {
        let value = |axis: &SurfaceAxis| columns::value(&axis.column, pull);
        let Some(at) = self.axes.iter().map(value).collect::<Option<Vec<Drawn>>>() else { return 1.0 };
        let log_factor =
            self.points.iter().zip(&self.weights).map(|(point, w)| w * self.likeness(point, &at));
        libm::exp(log_factor.sum::<f64>().clamp(-MOST, MOST))
    }

    fn likeness(&self, a: &[Drawn], b: &[Drawn]) -> f64 {
        let own = self.axes.iter().zip(a.iter().zip(b)).map(|(axis, (a, b))| {
            let scaled = |x: f64| if axis.logarithm { libm::log(x) } else { x };
            let apart = match (a, b) {
                (Drawn::Number(a), Drawn::Number(b)) => scaled(*a) - scaled(*b),
                (a, b) => f64::from(u8::from(a.to_string() != b.to_string())),
            };
            (apart / axis.length) * (apart / axis.length)
        });
        let distance = own.sum::<f64>();
        if distance.is_nan() { 0.0 } else { libm::exp(-0.5 * distance) }
    }
}

/// The logarithm of a factor is cut here, as tables are.
const MOST: f64 = 6.9;

const KEYS: [&str; 6] = ["columns", "lengths", "logarithm", "points", "weights", "physical"];

/// Checks a surface of a twin file. Errors name the key.
pub(crate) fn check_surface(file: &TwinFile, index: usize) -> Result<Surface, ConfigError> {
    let effect = &file.effects[index];
    let key = |name: &str| format!("effects[{index}].{name}");
    if let Some(name) = effect.parameters.keys().find(|name| !KEYS.contains(&name.as_str())) {
        let error = ConfigError::new(key(name), format!("a surface has no key `{name}`"));
        return Err(error.suggest(name, KEYS, || format!("its keys: {}", KEYS.join(", "))));
    }
    if let Some(part) = &effect.part {
        let problem = format!("a surface acts on all parts, found `{part}`");
        return Err(ConfigError::new(key("part"), problem).hint("name `part` among its columns"));
    }
    let get = |name: &str| effect.parameters.get(name);
    if get("physical") != Some(&toml::Value::Boolean(false)) {
        return Err(ConfigError::new(key("physical"), "a surface explains nothing, it must say so")
            .hint("add physical = false"));
    }
    let value = |name: &str| {
        get(name).ok_or_else(|| ConfigError::new(key(name), "a list with at least one value is needed"))
    };
    let names = list(value("columns")?, &key("columns"))?;
    let word = |(i, value): (usize, &toml::Value)| match value.as_str().filter(|name| !name.is_empty()) {
        Some(name) if names[..i].iter().all(|other| other.as_str() != Some(name)) => Ok(name.to_string()),
        Some(name) => Err(ConfigError::new(key(&format!("columns[{i}]")), format!("`{name}` stands twice"))),
        None => Err(ConfigError::new(key(&format!("columns[{i}]")), "the name of a column is needed")),
    };
    let names: Vec<String> = names.iter().enumerate().map(word).collect::<Result<_, _>>()?;
    let lengths = numbers(value("lengths")?, &key("lengths"))?;
    same_length(&key("lengths"), lengths.len(), names.len(), "columns")?;
    for (i, length) in lengths.iter().enumerate() {
        in_range(&key(&format!("lengths[{i}]")), *length, 1e-9..=1e9, "")?;
    }
    let logarithm = match get("logarithm") {
        None => vec![],
        Some(value) => value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]),
    };
    if let Some(other) = logarithm.iter().find(|v| !names.iter().any(|name| v.as_str() == Some(name))) {
        let problem = format!("{other} is none of its columns");
        return Err(
            ConfigError::new(key("logarithm"), problem).hint(format!("its columns: {}", names.join(", ")))
        );
    }
    let axes: Vec<SurfaceAxis> = (names.into_iter().zip(lengths))
        .map(|(column, length)| {
            let logarithm = logarithm.iter().any(|name| name.as_str() == Some(&column));
            SurfaceAxis { column, length, logarithm }
        })
        .collect();
    let point = |(k, value): (usize, &toml::Value)| {
        let at = key(&format!("points[{k}]"));
        let Some(row) = value.as_array() else {
            return Err(ConfigError::new(at, format!("a list of {} values is needed", axes.len())));
        };
        same_length(&at, row.len(), axes.len(), "columns")?;
        axes.iter().zip(row).map(|(axis, value)| place(axis, value, &at)).collect()
    };
    let points: Vec<Vec<Drawn>> =
        list(value("points")?, &key("points"))?.iter().enumerate().map(point).collect::<Result<_, _>>()?;
    let weights = numbers(value("weights")?, &key("weights"))?;
    same_length(&key("weights"), weights.len(), points.len(), "points")?;
    Ok(Surface { axes, points, weights })
}

/// A value of a point.
fn place(axis: &SurfaceAxis, value: &toml::Value, key: &str) -> Result<Drawn, ConfigError> {
    let column = &axis.column;
    let words = columns::covariate(column).map(Column::holds_words);
    let number = value.as_float().or_else(|| value.as_integer().map(|i| i as f64)).filter(|x| x.is_finite());
    match (number, value.as_str()) {
        (Some(x), _) if axis.logarithm && x <= 0.0 => {
            Err(ConfigError::new(key, format!("`{column}` counts by its logarithm, and {x} has none")))
        }
        (Some(x), _) if words != Some(true) => Ok(Drawn::Number(x)),
        (_, Some(word)) if words != Some(false) && !axis.logarithm => Ok(Drawn::Text(word.into())),
        _ => {
            let kind = if words == Some(true) { "a word" } else { "a number" };
            Err(ConfigError::new(key, format!("{kind} is needed for `{column}`, found {value}")))
        }
    }
}

fn same_length(key: &str, found: usize, wanted: usize, of: &str) -> Result<(), ConfigError> {
    let problem = || ConfigError::new(key, format!("{found} values for {wanted} {of}"));
    (found == wanted).then_some(()).ok_or_else(problem)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::twin;
    use crate::{Covariates, Scenario};

    fn at(part: &str, grip_force_n: f64, extra: &[(&str, f64)]) -> Scenario {
        let extra = extra.iter().map(|(k, v)| (k.to_string(), Drawn::Number(*v))).collect();
        let covariates = Covariates { extra, ..Covariates::default() };
        Scenario { part: part.into(), grip_force_n, covariates, ..Scenario::default() }
    }

    const SURFACE: &str = "[[effects]]\nname = \"surface\"\nphysical = false\ncolumns = [\"grip_force_n\", \"stroke\", \"part\"]\n\
        lengths = [1.0, 2.0, 1.0]\nlogarithm = [\"grip_force_n\"]\npoints = [[20, 1, \"rod\"], [40, 5, \"rod\"]]\nweights = [0.3, -0.1]\n";

    #[test]
    fn a_surface_is_the_sum_of_its_points_by_likeness() {
        let twin = twin(SURFACE).unwrap();
        assert!(twin.effects.is_empty() && twin.surfaces.len() == 1);
        let log = |scenario: &Scenario| twin.table_factor(scenario).ln();
        let far = std::f64::consts::LN_2;
        // One length of a logarithm away in load, two lengths in stroke.
        let wanted = 0.3 - 0.1 * (-0.5 * (far * far + 4.0)).exp();
        assert!((log(&at("rod", 20.0, &[("stroke", 1.0)])) - wanted).abs() < 1e-12);
        let other = log(&at("plate", 20.0, &[("stroke", 1.0)]));
        assert!((other - wanted * (-0.5_f64).exp()).abs() < 1e-12, "another word is a length away");
        assert_eq!(log(&at("rod", 20.0, &[])), 0.0, "a column without a value");
        assert!(log(&at("rod", 20.0, &[("stroke", 200.0)])).abs() < 1e-12, "far from all points");
        assert_eq!(twin.surfaces[0].columns().collect::<Vec<_>>(), ["grip_force_n", "stroke", "part"]);
    }

    #[test]
    fn errors_name_the_key() {
        for (from, to, wanted) in [
            ("physical = false", "physical = true", "effects[0].physical"),
            ("weights = [0.3, -0.1]", "weights = [0.3]", "effects[0].weights: 1 values for 2 points"),
            ("[20, 1, \"rod\"]", "[20, 1]", "effects[0].points[0]: 2 values for 3 columns"),
            ("[20, 1, \"rod\"]", "[-20, 1, \"rod\"]", "-20 has none"),
            ("[20, 1, \"rod\"]", "[20, 1, 3]", "a word is needed for `part`, found 3"),
            ("lengths = [1.0, 2.0, 1.0]", "lengths = [1.0, 0.0, 1.0]", "effects[0].lengths[1]"),
            ("\"stroke\", \"part\"", "\"part\", \"part\"", "`part` stands twice"),
            ("logarithm = [\"grip_force_n\"]", "logarithm = [\"grip\"]", "\"grip\" is none of its columns"),
            ("points", "point", "a surface has no key `point`"),
        ] {
            let error = twin(&SURFACE.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(wanted), "{to}: {error}");
        }
    }
}
