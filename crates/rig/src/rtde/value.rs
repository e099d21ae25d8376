//! Types and values of fields.

/// The type of a field, by its name on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldType {
    /// `BOOL`, 1 byte.
    Bool,
    /// `UINT8`, 1 byte.
    Uint8,
    /// `UINT32`, 4 bytes.
    Uint32,
    /// `UINT64`, 8 bytes.
    Uint64,
    /// `INT32`, 4 bytes.
    Int32,
    /// `DOUBLE`, 8 bytes.
    Double,
    /// `VECTOR3D`, 24 bytes.
    Vector3d,
    /// `VECTOR6D`, 48 bytes.
    Vector6d,
    /// `VECTOR6INT32`, 24 bytes.
    Vector6int32,
    /// `VECTOR6UINT32`, 24 bytes.
    Vector6uint32,
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Of a `BOOL`.
    Bool(bool),
    /// Of a `UINT8`.
    Uint8(u8),
    /// Of a `UINT32`.
    Uint32(u32),
    /// Of a `UINT64`.
    Uint64(u64),
    /// Of an `INT32`.
    Int32(i32),
    /// Of a `DOUBLE`.
    Double(f64),
    /// Of a `VECTOR3D`.
    Vector3d([f64; 3]),
    /// Of a `VECTOR6D`.
    Vector6d([f64; 6]),
    /// Of a `VECTOR6INT32`.
    Vector6int32([i32; 6]),
    /// Of a `VECTOR6UINT32`.
    Vector6uint32([u32; 6]),
}

/// A value where another type is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("field {index} is a {found:?}, its recipe says {wanted:?}")]
pub struct ValueError {
    /// Which field, counted from 0.
    pub index: usize,
    /// Type of the value.
    pub found: FieldType,
    /// Type of the recipe.
    pub wanted: FieldType,
}

impl FieldType {
    const NAMES: [(FieldType, &str, usize); 10] = [
        (FieldType::Bool, "BOOL", 1),
        (FieldType::Uint8, "UINT8", 1),
        (FieldType::Uint32, "UINT32", 4),
        (FieldType::Uint64, "UINT64", 8),
        (FieldType::Int32, "INT32", 4),
        (FieldType::Double, "DOUBLE", 8),
        (FieldType::Vector3d, "VECTOR3D", 24),
        (FieldType::Vector6d, "VECTOR6D", 48),
        (FieldType::Vector6int32, "VECTOR6INT32", 24),
        (FieldType::Vector6uint32, "VECTOR6UINT32", 24),
    ];

    /// The type with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, n, _)| *n == name).map(|(kind, _, _)| *kind)
    }

    /// Its name on the wire.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(kind, _, _)| *kind == self).map_or("", |(_, name, _)| name)
    }

    /// Bytes of a value.
    pub fn size(self) -> usize {
        Self::NAMES.iter().find(|(kind, _, _)| *kind == self).map_or(0, |(_, _, size)| *size)
    }

    /// Reads a value from exactly [`size`](Self::size) bytes.
    pub fn read(self, bytes: &[u8]) -> Option<Value> {
        Some(match self {
            FieldType::Bool => Value::Bool(*bytes.first()? != 0),
            FieldType::Uint8 => Value::Uint8(*bytes.first()?),
            FieldType::Uint32 => Value::Uint32(u32::from_be_bytes(bytes.try_into().ok()?)),
            FieldType::Uint64 => Value::Uint64(u64::from_be_bytes(bytes.try_into().ok()?)),
            FieldType::Int32 => Value::Int32(i32::from_be_bytes(bytes.try_into().ok()?)),
            FieldType::Double => Value::Double(f64::from_be_bytes(bytes.try_into().ok()?)),
            FieldType::Vector3d => Value::Vector3d(vector(bytes, f64::from_be_bytes)?),
            FieldType::Vector6d => Value::Vector6d(vector(bytes, f64::from_be_bytes)?),
            FieldType::Vector6int32 => Value::Vector6int32(vector(bytes, i32::from_be_bytes)?),
            FieldType::Vector6uint32 => Value::Vector6uint32(vector(bytes, u32::from_be_bytes)?),
        })
    }
}

fn vector<T, const SIZE: usize, const N: usize>(bytes: &[u8], of: fn([u8; SIZE]) -> T) -> Option<[T; N]> {
    let values: Vec<T> =
        bytes.chunks_exact(SIZE).map(|piece| Some(of(piece.try_into().ok()?))).collect::<Option<_>>()?;
    values.try_into().ok()
}

impl Value {
    /// Its type.
    pub fn field_type(&self) -> FieldType {
        match self {
            Value::Bool(_) => FieldType::Bool,
            Value::Uint8(_) => FieldType::Uint8,
            Value::Uint32(_) => FieldType::Uint32,
            Value::Uint64(_) => FieldType::Uint64,
            Value::Int32(_) => FieldType::Int32,
            Value::Double(_) => FieldType::Double,
            Value::Vector3d(_) => FieldType::Vector3d,
            Value::Vector6d(_) => FieldType::Vector6d,
            Value::Vector6int32(_) => FieldType::Vector6int32,
            Value::Vector6uint32(_) => FieldType::Vector6uint32,
        }
    }

    /// Appends its bytes.
    pub fn write(&self, out: &mut Vec<u8>) {
        match self {
            Value::Bool(x) => out.push(u8::from(*x)),
            Value::Uint8(x) => out.push(*x),
            Value::Uint32(x) => out.extend(x.to_be_bytes()),
            Value::Uint64(x) => out.extend(x.to_be_bytes()),
            Value::Int32(x) => out.extend(x.to_be_bytes()),
            Value::Double(x) => out.extend(x.to_be_bytes()),
            Value::Vector3d(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
            Value::Vector6d(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
            Value::Vector6int32(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
            Value::Vector6uint32(v) => v.iter().for_each(|x| out.extend(x.to_be_bytes())),
        }
    }
}
