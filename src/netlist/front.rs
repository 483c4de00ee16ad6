//! Front ends: what is drawn in one language or another becomes a structure, parameters and messages. Nothing after this knows
//! where a drawing came from.

use super::Loaded;
use super::bundle::Bundle;
use super::diagnostic::Diagnostics;
use super::foreign;
use super::setting::Setting;
use super::sugar2::Sugar2;
use std::fmt::Debug;

/// A drawing that has been read in its own language. What is drawn depends on the values of parameters too.
pub trait FrontEnd: Debug + Send + Sync {
    /// Draws it with parameters set from outside.
    ///
    /// # Errors
    /// Every error found in one run, those of reading too; warnings are among them.
    fn load(&self, set: &[(String, Setting)]) -> Result<Loaded, Diagnostics>;
}

/// Reads a bundle by the language of its root: SUGAR 3 where its first line that decides is Lua, else SUGAR 2.
pub(crate) fn read(bundle: &Bundle) -> Box<dyn FrontEnd> {
    #[cfg(feature = "lua")]
    if bundle.is_program() {
        return Box::new(super::sugar3::Sugar3::new(bundle));
    }
    Box::new(Sugar2::new(bundle))
}

impl Bundle {
    /// True when the root is a SUGAR 3 netlist: a program, in Lua.
    pub fn is_program(&self) -> bool {
        let root = self.files.get(&self.root).map_or("", String::as_str);
        matches!(foreign::kind(root, 0), foreign::Kind::Lua(_))
    }
}
