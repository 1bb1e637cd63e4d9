//! What the machine is that measures: its processor, the vector instructions that the loops run with, and how busy it is.

use std::env;
use std::fs;

use crate::command_line::CommandLine;

/// What `/proc/cpuinfo` must name for an instruction set, from the fastest to the slowest.
const SETS: [(&str, &[&str]); 2] =
    [("avx512", &["avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"]), ("avx2", &["avx2", "fma"])];

/// The machine, as far as its speed goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Machine {
    /// The processor by name, where the system tells it with family and model.
    pub(crate) processor: String,
    /// The instruction set of the inner loops.
    pub(crate) instruction_set: String,
}

impl Machine {
    /// This one; the variable that asks the loops for an instruction set counts.
    pub(crate) fn this() -> Self {
        let linux = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let apple = || CommandLine::new(["sysctl", "-n", "machdep.cpu.brand_string"]).output();
        let asked = env::var("CHAINWAVE_INSTRUCTION_SET").ok();
        let processor =
            processor(&linux).or_else(apple).unwrap_or_else(|| format!("unknown {}", env::consts::ARCH));
        Self { processor, instruction_set: asked.unwrap_or_else(|| instruction_set(&linux).to_owned()) }
    }

    /// A file name for its table.
    pub(crate) fn file_name(&self) -> String {
        let name = format!("{} {}", self.processor, self.instruction_set).to_lowercase();
        let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
        let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
        format!("{}.csv", words.join("-"))
    }
}

/// How many processes want to run, on average over the last minute, and on how many cores; where the system tells it.
pub(crate) fn load() -> Option<(f64, usize)> {
    let load = fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()?;
    Some((load, std::thread::available_parallelism().ok()?.get()))
}

fn field<'a>(cpuinfo: &'a str, name: &str) -> Option<&'a str> {
    let fields = cpuinfo.lines().filter_map(|line| line.split_once(':'));
    fields
        .map(|(key, value)| (key.trim(), value.trim()))
        .find_map(|(key, value)| (key == name).then_some(value))
}

/// The name alone may be that of a whole series.
fn processor(cpuinfo: &str) -> Option<String> {
    let name = field(cpuinfo, "model name")?;
    match (field(cpuinfo, "cpu family"), field(cpuinfo, "model")) {
        (Some(family), Some(model)) => Some(format!("{name} family {family} model {model}")),
        _ => Some(name.to_owned()),
    }
}

fn instruction_set(cpuinfo: &str) -> &'static str {
    let flags: Vec<&str> = field(cpuinfo, "flags").unwrap_or_default().split_whitespace().collect();
    let has = |needed: &&[&str]| needed.iter().all(|flag| flags.contains(flag));
    let found = SETS.iter().find_map(|(name, needed)| has(needed).then_some(*name));
    found.unwrap_or(if cfg!(target_arch = "aarch64") { "neon" } else { "portable" })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CPUINFO: &str = "\
processor\t: 0
cpu family\t: 25
model\t\t: 17
model name\t: AMD EPYC (R)
flags\t\t: fpu fma avx2 avx512f avx512dq avx512cd avx512bw
";

    #[test]
    fn a_processor_is_named_with_its_instructions() {
        assert_eq!(processor(CPUINFO).as_deref(), Some("AMD EPYC (R) family 25 model 17"));
        assert_eq!(instruction_set(CPUINFO), "avx2");
        assert_eq!(instruction_set(&CPUINFO.replace("avx512f", "avx512f avx512vl")), "avx512");
        assert_eq!(processor(""), None);
    }

    #[test]
    fn a_table_is_named_after_both() {
        let machine = Machine { processor: "AMD EPYC (R) family 25".into(), instruction_set: "avx2".into() };
        assert_eq!(machine.file_name(), "amd-epyc-r-family-25-avx2.csv");
    }
}
