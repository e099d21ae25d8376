//! Examples that `--help` ends with.

pub const INIT: &str = "Examples:
  gripgen init my-sweep
  gripgen init part.stl -o mine";
pub const TRY: &str = "Examples:
  gripgen try part.stl
  gripgen try part.stl --force-n 30 --mu 0.2 -o part.html";
pub const CHECK: &str = "Examples:
  gripgen check mine/sweep.toml
  gripgen check mine/sweep.toml --set samples=1000 --set design=random";
pub const SWEEP: &str = "Examples:
  gripgen sweep asset:configs/quickstart.toml
  gripgen sweep mine/sweep.toml -o runs/mine --set mechanics=reduced
  gripgen sweep mine/sweep.toml -o runs/mine --slice 3/16";
pub const INFO: &str = "Examples:
  gripgen info runs/quickstart
  gripgen info measured --json";
pub const VERIFY: &str = "Examples:
  gripgen verify runs/quickstart
  gripgen verify runs/quickstart --repair";
pub const SHOW: &str = "Examples:
  gripgen show runs/quickstart
  gripgen show runs/quickstart 57";
pub const VIEW: &str = "Examples:
  gripgen view runs/quickstart
  gripgen view measured/ -o monday.html
  gripgen view runs/quickstart/shard-00000.mcap --pulls 300";
pub const EXPORT: &str = "Examples:
  gripgen export runs/quickstart --to parquet -o quickstart.parquet
  gripgen export runs/quickstart --to lerobot -o quickstart-lerobot
  gripgen export runs/quickstart --to webdataset -o train-%05d.tar
  gripgen export runs/quickstart --sample 3 -o three.mcap";
pub const IMPORT: &str = "Examples:
  gripgen import lab-bags -o lab";
pub const CALIBRATE_PRESSES: &str = "Examples:
  gripgen calibrate presses presses --ball-mm 4 --mm-per-px 0.0877 -o my.npz
  gripgen calibrate presses dataPack.npz -o sensor.npz";
pub const CALIBRATE_PULLS: &str = "Examples:
  gripgen calibrate pulls measured -o fitted.toml
  gripgen calibrate pulls monday --also tuesday -o fitted.toml
  gripgen calibrate pulls measured --law offset -o fitted.toml";
pub const CALIBRATE_SENSOR: &str = "Examples:
  gripgen calibrate sensor two_sensors -o fitted.toml";
pub const CALIBRATE_IMPRINTS: &str = "Examples:
  gripgen calibrate imprints imprints -o fitted.toml";
pub const COMPARE: &str = "Examples:
  gripgen compare measured --twin diagnosed.toml
  gripgen compare presses --sensor sensor.npz --report presses.html";
pub const SENSOR_CHECK: &str = "Examples:
  gripgen sensor check sensor.npz five-presses
  gripgen sensor check sensor.npz five-presses -o today.npz --report today.html";
pub const DIAGNOSE: &str = "Examples:
  gripgen diagnose measured
  gripgen diagnose measured -o diagnosed.toml --report report.html
  gripgen diagnose lab --twin fitted.toml";
pub const RENDER: &str = "Examples:
  gripgen render part.stl --depth-mm 0.5 --sensor sensor.npz -o part.png
  gripgen render heights.npy --sensor sensor.npz -o ridges.png";
pub const EFFECTS: &str = "Examples:
  gripgen effects
  gripgen effects dwell_ageing";
pub const CAMPAIGN: &str = "Examples:
  gripgen campaign -o campaign.toml --parts gear
  gripgen campaign -o next.toml --separate measured
  gripgen campaign -o campaign.toml --simulate practice";
pub const RIG_CHECK: &str = "Examples:
  gripgen rig check
  gripgen rig check rig.toml --mass-kg 1.0";
pub const RIG_TEACH: &str = "Examples:
  gripgen rig teach gear --rig rig.toml";
pub const RIG_REHEARSE: &str = "Examples:
  gripgen rig rehearse rig.toml -o rehearsal.json";
pub const RIG_PULL: &str = "Examples:
  gripgen rig pull --parts gear --grip-force-n 20,40 -o runs/first
  gripgen rig pull rig.toml --campaign campaign.toml -o runs/monday";
pub const RIG_SERVE: &str = "Examples:
  gripgen rig serve
  gripgen rig serve my-twin.toml --speed 20 --seed 3";
pub const BENCH: &str = "Examples:
  gripgen bench";
pub const SCHEMA: &str = "Examples:
  gripgen schema sweep > sweep.schema.json
  gripgen schema rosbag > rosbag.schema.json";
pub const COMPLETIONS: &str = "Examples:
  gripgen completions bash > ~/.local/share/bash-completion/completions/gripgen";

#[cfg(test)]
mod tests {
    use crate::args::Cli;
    use clap::{Command, CommandFactory, Parser};

    fn leaves(command: Command) -> Vec<Command> {
        let subcommands: Vec<Command> = command.get_subcommands().cloned().collect();
        if subcommands.is_empty() {
            return vec![command];
        }
        subcommands.into_iter().flat_map(leaves).collect()
    }

    #[test]
    fn every_verb_has_examples_that_can_be_typed() {
        let mut verbs = 0;
        for verb in leaves(Cli::command()) {
            let name = verb.get_name().to_string();
            let help = verb.get_after_help().unwrap_or_else(|| panic!("{name} has no examples")).to_string();
            let mut lines = help.lines();
            assert_eq!(lines.next(), Some("Examples:"), "{name}");
            let examples: Vec<&str> = lines.collect();
            assert!(!examples.is_empty(), "{name}");
            for line in examples {
                assert!(line.len() <= 80, "{line}");
                let typed = line.split(" > ").next().unwrap_or(line).split_whitespace();
                let typed: Vec<&str> = typed.collect();
                assert!(typed.contains(&name.as_str()), "{name}: {line}");
                if let Err(e) = Cli::try_parse_from(&typed) {
                    panic!("{line}: {e}");
                }
            }
            verbs += 1;
        }
        assert_eq!(verbs, 28, "a new verb gets an example");
    }

    /// Texts of the program that stand between back quotes and begin with its name.
    fn named_commands(folder: &std::path::Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap().map_while(Result::ok) {
            let path = entry.path();
            if path.is_dir() {
                named_commands(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                let quoted = text.split('`').skip(1).step_by(2);
                found.extend(quoted.filter(|words| words.starts_with("gripgen ")).map(String::from));
            }
        }
    }

    /// A hint works when it is followed: what messages tell people to type, verbs and flags, is there.
    #[test]
    fn commands_that_messages_name_are_there() {
        let crates = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let mut named = Vec::new();
        for name in ["cli", "identify", "measured", "record", "report", "rig", "rig_sim", "tactile", "twin"] {
            named_commands(&crates.join(name).join("src"), &mut named);
        }
        assert!(named.len() > 50, "{named:?}");
        // `import` is the Python package's; what stands in braces is put in later.
        for command in named.iter().filter(|words| !words.contains(['{', '\n']) && *words != "gripgen import")
        {
            let (mut verb, mut is_group) = (Cli::command(), true);
            for word in command.split_whitespace().skip(1) {
                if word == "import" {
                    break;
                }
                if let Some(flag) = word.strip_prefix("--") {
                    let flag = flag.split('=').next();
                    let known = verb.get_arguments().any(|argument| argument.get_long() == flag);
                    assert!(known, "`{command}`: {} has no --{flag:?}", verb.get_name());
                } else if is_group {
                    let found = verb.find_subcommand(word).cloned();
                    verb = found.unwrap_or_else(|| panic!("`{command}`: there is no verb {word}"));
                    is_group = verb.has_subcommands();
                }
            }
        }
    }
}
