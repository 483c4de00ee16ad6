//! Names of pins: those of ports and signals with the characters that simulators take.

use super::ExportError;
use super::linear::{ReducedPort, SignalShown};

/// Pins of a written model, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pins {
    /// Positive and negative pin of each port.
    pub ports: Vec<[String; 2]>,
    /// Pin of each signal, a voltage against ground.
    pub signals: Vec<String>,
}

impl Pins {
    /// Those of a model: `p_NAME`, `n_NAME` of each port, `s_NAME` of each signal.
    ///
    /// # Errors
    /// [`ExportError::SameName`] where two become one.
    pub fn of(ports: &[ReducedPort], signals: &[SignalShown]) -> Result<Self, ExportError> {
        let (all_ports, all_signals) = (ports, signals);
        let ports: Vec<String> = ports.iter().map(|p| plain(&p.name)).collect();
        let signals: Vec<String> = signals.iter().map(|s| plain(&s.name)).collect();
        let named = |plain: &[String], full: &dyn Fn(usize) -> String| {
            for (k, name) in plain.iter().enumerate() {
                if let Some(j) = plain[..k].iter().position(|n| n == name) {
                    return Err(ExportError::SameName { first: full(j), second: full(k), name: name.clone() });
                }
            }
            Ok(())
        };
        named(&ports, &|k| all_ports[k].name.clone())?;
        named(&signals, &|k| all_signals[k].name.clone())?;
        Ok(Self {
            ports: ports.iter().map(|n| [format!("p_{n}"), format!("n_{n}")]).collect(),
            signals: signals.iter().map(|n| format!("s_{n}")).collect(),
        })
    }

    /// All of them in the order of the subcircuit's line.
    pub fn all(&self) -> impl Iterator<Item = &str> {
        self.ports.iter().flatten().chain(&self.signals).map(String::as_str)
    }
}

/// Lower case, with `_` in place of every run of other characters.
fn plain(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            out.push(c.to_ascii_lowercase());
        } else if !out.ends_with('_') && !out.is_empty() {
            out.push('_');
        }
    }
    out.trim_end_matches('_').to_owned()
}

/// Words of Verilog-A (LRM 2.4, annex B) and the disciplines of its standard header, which no module may be named
/// after.
const RESERVED: [&str; 221] = [
    "above",
    "abs",
    "absdelay",
    "abstol",
    "ac_stim",
    "access",
    "acos",
    "acosh",
    "aliasparam",
    "always",
    "analog",
    "analysis",
    "and",
    "asin",
    "asinh",
    "assert",
    "assign",
    "atan",
    "atan2",
    "atanh",
    "automatic",
    "begin",
    "branch",
    "buf",
    "bufif0",
    "bufif1",
    "case",
    "casex",
    "casez",
    "ceil",
    "cell",
    "cmos",
    "config",
    "connect",
    "connectmodule",
    "connectrules",
    "continuous",
    "cos",
    "cosh",
    "cross",
    "current",
    "ddt",
    "ddt_nature",
    "ddx",
    "deassign",
    "default",
    "defparam",
    "design",
    "disable",
    "discipline",
    "discrete",
    "domain",
    "driver_update",
    "edge",
    "electrical",
    "else",
    "end",
    "endcase",
    "endconfig",
    "endconnectrules",
    "enddiscipline",
    "endfunction",
    "endgenerate",
    "endmodule",
    "endnature",
    "endparamset",
    "endprimitive",
    "endspecify",
    "endtable",
    "endtask",
    "event",
    "exclude",
    "exp",
    "final_step",
    "flicker_noise",
    "floor",
    "flow",
    "for",
    "force",
    "forever",
    "fork",
    "from",
    "function",
    "generate",
    "genvar",
    "ground",
    "highz0",
    "highz1",
    "hypot",
    "idt",
    "idt_nature",
    "idtmod",
    "if",
    "ifnone",
    "incdir",
    "include",
    "inf",
    "initial",
    "initial_step",
    "inout",
    "input",
    "instance",
    "integer",
    "join",
    "kinematic",
    "kinematic_v",
    "laplace_nd",
    "laplace_np",
    "laplace_zd",
    "laplace_zp",
    "large",
    "last_crossing",
    "liblist",
    "library",
    "limexp",
    "ln",
    "localparam",
    "log",
    "logic",
    "macromodule",
    "magnetic",
    "max",
    "medium",
    "merged",
    "min",
    "module",
    "nand",
    "nature",
    "negedge",
    "net",
    "net_resolution",
    "nmos",
    "noise_table",
    "nor",
    "noshowcancelled",
    "not",
    "notif0",
    "notif1",
    "or",
    "output",
    "parameter",
    "paramset",
    "pmos",
    "posedge",
    "potential",
    "pow",
    "primitive",
    "pull0",
    "pull1",
    "pulldown",
    "pullup",
    "pulsestyle_ondetect",
    "pulsestyle_onevent",
    "rcmos",
    "real",
    "realtime",
    "reg",
    "release",
    "repeat",
    "resolveto",
    "rnmos",
    "rotational",
    "rotational_omega",
    "rpmos",
    "rtran",
    "rtranif0",
    "rtranif1",
    "scalared",
    "showcancelled",
    "signed",
    "sin",
    "sinh",
    "slew",
    "small",
    "specify",
    "specparam",
    "split",
    "sqrt",
    "string",
    "strong0",
    "strong1",
    "supply0",
    "supply1",
    "table",
    "tan",
    "tanh",
    "task",
    "thermal",
    "time",
    "timer",
    "tran",
    "tranif0",
    "tranif1",
    "transition",
    "tri",
    "tri0",
    "tri1",
    "triand",
    "trior",
    "trireg",
    "units",
    "unsigned",
    "use",
    "uwire",
    "vectored",
    "voltage",
    "wait",
    "wand",
    "weak0",
    "weak1",
    "while",
    "white_noise",
    "wire",
    "wor",
    "wreal",
    "xnor",
    "xor",
    "zi_nd",
    "zi_np",
    "zi_zd",
    "zi_zp",
];

/// Checks the name of a subcircuit or module.
///
/// # Errors
/// [`ExportError::BadName`].
pub fn checked(name: &str) -> Result<&str, ExportError> {
    if RESERVED.contains(&name.to_ascii_lowercase().as_str()) {
        return Err(ExportError::BadName { got: name.to_owned() });
    }
    let good = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if good { Ok(name) } else { Err(ExportError::BadName { got: name.to_owned() }) }
}

/// A name made of a file's.
pub fn from_file(stem: &str) -> String {
    let name = plain(stem);
    let own = name.starts_with(|c: char| c.is_ascii_alphabetic()) && !RESERVED.contains(&name.as_str());
    if own { name } else { format!("m_{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names keep letters and digits, in lower case; a name for a module begins with a letter.
    #[test]
    fn plain_names() {
        assert_eq!(plain("x1(2).Y"), "x1_2_y");
        assert_eq!(plain("b1.hot.T"), "b1_hot_t");
        assert_eq!(from_file("3arms"), "m_3arms");
        assert_eq!((from_file("analog"), from_file("table")), ("m_analog".to_owned(), "m_table".to_owned()));
        assert_eq!(checked("bank_2"), Ok("bank_2"));
        assert!(checked("module").is_err() && checked("Real").is_err());
        assert!(["while", "sqrt", "release", "electrical"].iter().all(|word| checked(word).is_err()));
        assert!(checked("2bank").is_err() && checked("a b").is_err() && checked("").is_err());
    }
}
