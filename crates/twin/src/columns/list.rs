//! The columns. To add one, see `docs/adding-a-column.md`.

use super::{Column, Held, InTable, Kind, Range, Scale};

/// A covariate that is a number of any size and is stored nowhere else.
const COLUMN: Column = Column {
    name: "",
    unit: "",
    about: "",
    kind: Kind::Number,
    aliases: &[],
    in_table: InTable::Covariate,
    table_range: Range::Any,
    sweep_range: Range::Any,
    scale: Scale::Si,
    indexed: true,
    known_to_rig: true,
    held: Held::Extra,
};

/// The columns of a pull, in the order of `index.csv` and of the keys of `[vary]`.
pub const COLUMNS: &[Column] = &[
    Column {
        name: "part",
        about: "name of the part",
        kind: Kind::Name,
        in_table: InTable::Required,
        held: Held::Word { get: |pull| pull.part, set: |pull, word| *pull.part = word },
        ..COLUMN
    },
    Column {
        name: "grip_pose",
        unit: "1",
        about: "which of the part's grips in the twin, counted from 0",
        kind: Kind::Whole,
        in_table: InTable::Absent,
        sweep_range: Range::Between(0.0, 1e6),
        held: Held::Number {
            get: |pull| Some(pull.grip_pose as f64),
            set: |pull, x| *pull.grip_pose = x as usize,
        },
        ..COLUMN
    },
    Column {
        name: "rig_id",
        about: "which rig",
        kind: Kind::Word,
        in_table: InTable::Absent,
        indexed: false,
        known_to_rig: false,
        ..COLUMN
    },
    Column {
        name: "gel_id",
        about: "which gel is mounted",
        kind: Kind::Word,
        held: Held::Word {
            get: |pull| &pull.covariates.gel_id,
            set: |pull, word| pull.covariates.gel_id = word,
        },
        ..COLUMN
    },
    Column {
        name: "session",
        about: "which session of work",
        kind: Kind::Word,
        held: Held::Word {
            get: |pull| &pull.covariates.session,
            set: |pull, word| pull.covariates.session = word,
        },
        ..COLUMN
    },
    Column {
        name: "grip_force_n",
        unit: "N",
        about: "grip force, per jaw",
        in_table: InTable::Required,
        table_range: Range::AboveZero,
        sweep_range: Range::Between(0.05, 2000.0),
        held: Held::Number {
            get: |pull| Some(pull.grip_force_n),
            set: |pull, newtons| *pull.grip_force_n = newtons,
        },
        ..COLUMN
    },
    Column {
        name: "force_increment_n",
        unit: "N",
        about: "height of a step of the force staircase",
        aliases: &["pull.increment_n"],
        table_range: Range::AboveZero,
        sweep_range: Range::Between(0.01, 50.0),
        held: Held::Number {
            get: |pull| Some(pull.increment_n),
            set: |pull, newtons| *pull.increment_n = newtons,
        },
        ..COLUMN
    },
    Column {
        name: "force_start_n",
        unit: "N",
        about: "force of the first step, one increment where nobody wrote it down",
        aliases: &["pull.start_n"],
        in_table: InTable::Setting,
        table_range: Range::FromZero,
        sweep_range: Range::Between(0.0, 10_000.0),
        indexed: false,
        held: Held::Number { get: |pull| pull.start_n, set: |pull, newtons| *pull.start_n = Some(newtons) },
        ..COLUMN
    },
    Column {
        name: "step_time_s",
        unit: "s",
        about: "length of a step, its mean where it jitters",
        aliases: &["pull.step_s", "pull.step_s.value"],
        table_range: Range::AboveZero,
        sweep_range: Range::Between(0.004, 10.0),
        held: Held::Number { get: |pull| Some(pull.step_s), set: |pull, seconds| *pull.step_s = seconds },
        ..COLUMN
    },
    Column {
        name: "dwell_s",
        unit: "s",
        about: "time from closing the jaws to the start of the pull",
        table_range: Range::FromZero,
        sweep_range: Range::Between(0.0, 1e6),
        held: Held::Number {
            get: |pull| Some(pull.covariates.dwell_s),
            set: |pull, seconds| pull.covariates.dwell_s = seconds,
        },
        ..COLUMN
    },
    Column {
        name: "pull_index",
        unit: "1",
        about: "pulls made since the gel was new",
        kind: Kind::Whole,
        table_range: Range::Between(0.0, 1e15),
        sweep_range: Range::Between(0.0, 1e12),
        held: Held::Number {
            get: |pull| Some(pull.covariates.pull_index as f64),
            set: |pull, x| pull.covariates.pull_index = x as u64,
        },
        ..COLUMN
    },
    Column {
        name: "time_s",
        unit: "s",
        about: "time since the start of the campaign",
        sweep_range: Range::Between(0.0, 1e9),
        held: Held::Number {
            get: |pull| Some(pull.covariates.time_s),
            set: |pull, seconds| pull.covariates.time_s = seconds,
        },
        ..COLUMN
    },
    Column {
        name: "temperature_c",
        unit: "C",
        about: "temperature of the gel, in degrees Celsius",
        sweep_range: Range::Between(-40.0, 120.0),
        known_to_rig: false,
        held: Held::Number {
            get: |pull| Some(pull.covariates.temperature_c),
            set: |pull, celsius| pull.covariates.temperature_c = celsius,
        },
        ..COLUMN
    },
    Column {
        name: "grip_offset_mm",
        unit: "mm",
        about: "lever between grip centre and pull line, along the part's long axis",
        sweep_range: Range::Between(-1000.0, 1000.0),
        scale: Scale::Thousandth,
        held: Held::Number {
            get: |pull| Some(pull.covariates.grip_offset_m),
            set: |pull, metres| pull.covariates.grip_offset_m = metres,
        },
        ..COLUMN
    },
    Column {
        name: "grip_angle_deg",
        unit: "deg",
        about: "angle of the grip about the jaw axis",
        sweep_range: Range::Between(-3600.0, 3600.0),
        scale: Scale::Degree,
        held: Held::Number {
            get: |pull| Some(pull.covariates.grip_angle_rad),
            set: |pull, radians| pull.covariates.grip_angle_rad = radians,
        },
        ..COLUMN
    },
    Column {
        name: "pull_direction",
        unit: "1",
        about: "1 along the pull direction of the sweep, -1 against it",
        kind: Kind::Direction,
        held: Held::Number {
            get: |pull| Some(pull.covariates.pull_direction),
            set: |pull, sign| pull.covariates.pull_direction = sign,
        },
        ..COLUMN
    },
];
