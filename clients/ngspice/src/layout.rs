//! Which ngspice loaded the plug-in, found out from what the host itself wrote.
//!
//! A host registers a code model before it hands out its function table. While registering, it stores two pointers to
//! its own constants (size of an instance, size of a model) into the device table, at the offsets at which *it* has
//! these fields. The offset identifies the build flags, and the size the generation:
//!
//! | | 39…41 | 42…46 | 47 |
//! |---|---|---|---|
//! | size of an instance | 152 | 160 | 224 |
//!
//! offset = 360 + 8 with OSDI + 16 with CIDER. Measured with `offsetof` on ngspice 39.3 to 47 in every build.

use thiserror::Error;

/// Words in the device table of the plug-in; larger than any host's.
pub const TABLE_WORDS: usize = 64;

/// The first word that is left empty for the host.
const FIRST_FREE_WORD: usize = 17;

/// Hosts that lay out parameters and calls alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Generation {
    /// ngspice 39 to 41.
    Since39,
    /// ngspice 42.
    Since42,
    /// ngspice 43 to 46.
    Since43,
    /// ngspice 47.
    Since47,
}

/// Where a host keeps what the plug-in fills in or reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HostLayout {
    /// Generation of the host.
    pub generation: Generation,
    /// Built with OSDI: one more pointer in the device table.
    pub osdi: bool,
    /// Built with CIDER: two more pointers in the device table.
    pub cider: bool,
}

/// A host whose layout is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum HostLayoutError {
    /// The host wrote no sizes, or at no known place.
    #[error(
        "this ngspice has an unknown device table (instance size field at byte {offset:?}); known are ngspice 39 to 47"
    )]
    Table {
        /// Where the size was found (byte).
        offset: Option<usize>,
    },
    /// The host's instances have a size that no known version has.
    #[error(
        "this ngspice has code model instances of {size} bytes; known are 152 (39 to 41), 160 (42 to 46) and 224 (47)"
    )]
    Instance {
        /// Size of an instance (byte).
        size: i32,
    },
}

impl HostLayout {
    /// Finds the layout from the device table after registration. `size_at` reads the number a word points to.
    /// `version` is the host's major version where the user gave one, which distinguishes 42 from 43.
    ///
    /// # Errors
    /// [`HostLayoutError`] for a host that is not known.
    pub fn detect(
        table: &[usize; TABLE_WORDS],
        size_at: impl Fn(usize) -> i32,
        version: Option<u32>,
    ) -> Result<Self, HostLayoutError> {
        let word = (FIRST_FREE_WORD..TABLE_WORDS - 1).find(|&w| table[w] != 0 && table[w + 1] != 0);
        let offset = word.map(|w| w * 8);
        let (osdi, cider) = match offset {
            Some(360) => (false, false),
            Some(368) => (true, false),
            Some(376) => (false, true),
            Some(384) => (true, true),
            _ => return Err(HostLayoutError::Table { offset }),
        };
        let size = word.map_or(0, |w| size_at(table[w]));
        let generation = match (size, version) {
            (152, _) => Generation::Since39,
            (160, Some(v)) if v <= 42 => Generation::Since42,
            (160, Some(_)) => Generation::Since43,
            // 42 and 43 differ in nothing the host shows; OSDI became the default with 43.
            (160, None) => [Generation::Since42, Generation::Since43][usize::from(osdi)],
            (224, _) => Generation::Since47,
            _ => return Err(HostLayoutError::Instance { size }),
        };
        Ok(Self { generation, osdi, cider })
    }

    /// Offset of the first device function, `DEVparam` (byte).
    pub fn functions(&self) -> usize {
        136 + 8 * usize::from(self.osdi)
    }

    /// Offset of the two sizes that the host wrote; what a host with KLU calls follows them (byte).
    pub fn sizes(&self) -> usize {
        360 + 8 * usize::from(self.osdi) + 16 * usize::from(self.cider)
    }

    /// Where the circuit's mode may stand: the likelier place first (byte).
    pub fn mode_offsets(&self) -> [usize; 2] {
        match self.generation {
            Generation::Since39 | Generation::Since42 => [392, 392],
            Generation::Since43 => [392, 400],
            Generation::Since47 => [400, 400],
        }
    }

    /// Slot of the function that returns the circuit in ngspice 42 to 44, and the deck's directory from 45 on; `None`
    /// where the generation alone is sufficient.
    pub fn telling_slot(&self) -> Option<usize> {
        (self.generation == Generation::Since43).then_some(49)
    }

    /// First of the three slots by which a host with KLU binds matrix entries; none for hosts that have no KLU.
    /// `until_44`: result of the function in [`Self::telling_slot`].
    pub fn bind_slot(&self, until_44: bool) -> Option<usize> {
        match self.generation {
            Generation::Since39 => None,
            Generation::Since42 => Some(61),
            Generation::Since43 if until_44 => Some(61),
            Generation::Since43 | Generation::Since47 => Some(62),
        }
    }

    /// Offset of a port's matrix data, with its node numbers (byte). `partial_at_80`: the host keeps a port's partials
    /// where ngspice 39 does.
    pub fn port_matrix(&self, partial_at_80: bool) -> usize {
        if partial_at_80 { 144 } else { 152 }
    }

    /// Offset of the connections in a call (byte).
    pub fn call_tail(&self) -> usize {
        if self.generation == Generation::Since47 { 120 } else { 104 }
    }

    /// Whether parameters are declared as from 43 on.
    pub fn new_parameters(&self) -> bool {
        self.generation >= Generation::Since43
    }

    /// Slot of the host's function that returns the deck's directory. `partial_at_80`: the host keeps a port's partials
    /// where ngspice 39 does; `until_44`: result of the function in [`Self::telling_slot`].
    pub fn deck_path_slot(&self, partial_at_80: bool, until_44: bool) -> usize {
        match self.generation {
            Generation::Since39 if partial_at_80 => 45,
            Generation::Since39 => 47,
            Generation::Since42 => 48,
            Generation::Since43 if until_44 => 48,
            Generation::Since43 | Generation::Since47 => 49,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(offset: usize, size: i32) -> ([usize; TABLE_WORDS], impl Fn(usize) -> i32) {
        let mut table = [0; TABLE_WORDS];
        (table[offset / 8], table[offset / 8 + 1]) = (0x1000, 0x2000);
        (table, move |at| if at == 0x1000 { size } else { 64 })
    }

    /// Every build of ngspice 39.3 to 47 is recognised from its device table; offsets measured with `offsetof`.
    #[test]
    fn recognises_every_measured_build() {
        use Generation::*;
        let builds = [
            (360, 152, Since39, 136, 104),
            (376, 152, Since39, 136, 104), // Debian 12, ngspice 39.3 with CIDER
            (368, 152, Since39, 144, 104),
            (384, 152, Since39, 144, 104),
            (360, 160, Since42, 136, 104),
            (376, 160, Since42, 136, 104),
            (368, 160, Since43, 144, 104),
            (384, 160, Since43, 144, 104), // Debian 13, ngspice 44.2 with CIDER, OSDI and KLU
            (384, 224, Since47, 144, 120), // ngspice 47 with CIDER, OSDI and KLU
        ];
        for (offset, size, generation, functions, tail) in builds {
            let (table, size_at) = host(offset, size);
            let layout = HostLayout::detect(&table, size_at, None).unwrap();
            assert_eq!((layout.generation, layout.functions(), layout.call_tail()), (generation, functions, tail));
            assert_eq!(layout.sizes(), offset);
        }
    }

    /// A host without OSDI cannot show whether it is 42 or 43; the user can say so.
    #[test]
    fn version_given_by_the_user_decides_between_42_and_43() {
        let (table, size_at) = host(360, 160);
        let layout = HostLayout::detect(&table, &size_at, Some(45)).unwrap();
        assert_eq!(layout.generation, Generation::Since43);
        assert!(layout.new_parameters());
        assert_eq!(HostLayout::detect(&table, &size_at, Some(42)).unwrap().generation, Generation::Since42);
    }

    /// The functions that bind KLU's matrix stand behind all others: read from the code models that Debian's ngspice 44.2
    /// and 47 ship, which call slots 61 to 63 and 62 to 64; 45 added a function before them.
    #[test]
    fn klu_is_bound_by_the_hosts_own_functions() {
        let layout =
            |size, osdi| HostLayout::detect(&host(if osdi { 384 } else { 376 }, size).0, |_| size, None).unwrap();
        assert_eq!(layout(152, false).bind_slot(false), None);
        assert_eq!([layout(160, true).bind_slot(true), layout(160, true).bind_slot(false)], [Some(61), Some(62)]);
        assert_eq!(layout(224, true).bind_slot(false), Some(62));
    }

    /// An unknown host is refused with the number that was not understood.
    #[test]
    fn refuses_unknown_hosts() {
        let (table, size_at) = host(400, 160);
        assert_eq!(HostLayout::detect(&table, size_at, None), Err(HostLayoutError::Table { offset: Some(400) }));
        let (table, size_at) = host(384, 232);
        assert_eq!(HostLayout::detect(&table, size_at, None), Err(HostLayoutError::Instance { size: 232 }));
        assert_eq!(HostLayout::detect(&[0; TABLE_WORDS], |_| 0, None), Err(HostLayoutError::Table { offset: None }));
    }
}
