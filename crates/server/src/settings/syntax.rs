//! Syntax of the settings of a server: whole numbers, bytes, times, files, addresses.

use bimorph_wire::address::Address;
use std::marker::PhantomData;
use std::path::PathBuf;
use std::time::Duration;

/// A way of writing a value.
pub trait ValueSyntax {
    /// Type of the value.
    type Held;
    /// Placeholder for the value in help: `N`, `BYTES`.
    const METAVAR: &'static str;

    /// Reads it.
    ///
    /// # Errors
    /// The expected syntax.
    fn read(text: &str) -> Result<Self::Held, &'static str>;

    /// Writes it so that it reads back; empty: nothing.
    fn write(held: &Self::Held) -> String;
}

fn whole(text: &str) -> Option<usize> {
    text.parse().ok().filter(|n| *n > 0)
}

/// Largest number of anything: sums and small multiples of such still are numbers.
const MAX_NUMBER: usize = 1_000_000_000_000_000;

/// A whole number above 0.
#[derive(Debug)]
pub struct PositiveCount;

impl ValueSyntax for PositiveCount {
    type Held = usize;
    const METAVAR: &'static str = "N";

    fn read(text: &str) -> Result<usize, &'static str> {
        whole(text).filter(|n| *n <= MAX_NUMBER).ok_or("a whole number above 0, at most 1e15")
    }

    fn write(held: &usize) -> String {
        held.to_string()
    }
}

/// Syntax whose value may also be absent, written as 0.
pub trait OptionalSyntax: ValueSyntax {
    /// The expected syntax where it may.
    const OR_NONE: &'static str;
}

impl OptionalSyntax for PositiveCount {
    const OR_NONE: &'static str = "a whole number, at most 1e15; 0: any";
}

impl OptionalSyntax for ByteSize {
    const OR_NONE: &'static str = "bytes, as 0, 1000000, 64M or 2G";
}

impl OptionalSyntax for PositiveSeconds {
    const OR_NONE: &'static str = "seconds, at most 1e9; 0: any";
}

/// One of those, or none.
#[derive(Debug)]
pub struct OrNone<W>(PhantomData<W>);

impl<W: OptionalSyntax<Held: Default>> ValueSyntax for OrNone<W> {
    type Held = W::Held;
    const METAVAR: &'static str = W::METAVAR;

    fn read(text: &str) -> Result<W::Held, &'static str> {
        if text == "0" { Ok(W::Held::default()) } else { W::read(text).map_err(|_| W::OR_NONE) }
    }

    fn write(held: &W::Held) -> String {
        W::write(held)
    }
}

/// A whole number, or none.
pub type CountOrNone = OrNone<PositiveCount>;
/// Bytes, or none.
pub type BytesOrNone = OrNone<ByteSize>;
/// A time in seconds, or none.
pub type TimeOrNone = OrNone<PositiveSeconds>;

/// Bytes: a whole number above 0, with an optional k, M or G (times 1024).
#[derive(Debug)]
pub struct ByteSize;

impl ValueSyntax for ByteSize {
    type Held = usize;
    const METAVAR: &'static str = "BYTES";

    fn read(text: &str) -> Result<usize, &'static str> {
        let (digits, shift) = match text.char_indices().last() {
            Some((at, 'k')) => (&text[..at], 10),
            Some((at, 'M')) => (&text[..at], 20),
            Some((at, 'G')) => (&text[..at], 30),
            _ => (text, 0),
        };
        whole(digits).and_then(|n| n.checked_mul(1 << shift)).ok_or("bytes above 0, as 1000000, 64M or 2G")
    }

    fn write(held: &usize) -> String {
        let unit = [(30, "G"), (20, "M"), (10, "k")]
            .into_iter()
            .find(|(shift, _)| *held > 0 && held.is_multiple_of(1 << shift));
        unit.map_or(held.to_string(), |(shift, unit)| format!("{}{unit}", held >> shift))
    }
}

/// A time in seconds, above 0.
#[derive(Debug)]
pub struct PositiveSeconds;

impl ValueSyntax for PositiveSeconds {
    type Held = Duration;
    const METAVAR: &'static str = "SECONDS";

    fn read(text: &str) -> Result<Duration, &'static str> {
        let seconds = text.parse::<f64>().ok().filter(|s| *s > 0.0 && *s <= 1e9);
        seconds.map(Duration::from_secs_f64).ok_or("seconds above 0, at most 1e9")
    }

    fn write(held: &Duration) -> String {
        held.as_secs_f64().to_string()
    }
}

/// A path, or nothing.
#[derive(Debug)]
pub struct PathOrNone;

impl ValueSyntax for PathOrNone {
    type Held = Option<PathBuf>;
    const METAVAR: &'static str = "FILE";

    fn read(text: &str) -> Result<Option<PathBuf>, &'static str> {
        if text.is_empty() { Err("a path") } else { Ok(Some(text.into())) }
    }

    fn write(held: &Option<PathBuf>) -> String {
        held.as_ref().map_or(String::new(), |path| path.display().to_string())
    }
}

/// An address, or nothing.
#[derive(Debug)]
pub struct AddressOrNone;

impl ValueSyntax for AddressOrNone {
    type Held = Option<Address>;
    const METAVAR: &'static str = "ADDRESS";

    fn read(text: &str) -> Result<Option<Address>, &'static str> {
        text.parse().map(Some).map_err(|_| "host:port or unix:///path")
    }

    fn write(held: &Option<Address>) -> String {
        held.as_ref().map_or(String::new(), Address::to_string)
    }
}

/// Addresses, separated by commas.
#[derive(Debug)]
pub struct AddressList;

impl ValueSyntax for AddressList {
    type Held = Vec<Address>;
    const METAVAR: &'static str = "ADDRESS";

    fn read(text: &str) -> Result<Vec<Address>, &'static str> {
        let read: Result<Vec<_>, _> = text.split(',').map(|place| place.trim().parse()).collect();
        read.map_err(
            |_| "unix:///path, host:port or https://host:port, of a host that is known; several with commas between",
        )
    }

    fn write(held: &Vec<Address>) -> String {
        held.iter().map(Address::to_string).collect::<Vec<_>>().join(",")
    }
}

/// Yes or no.
#[derive(Debug)]
pub struct YesOrNo;

impl ValueSyntax for YesOrNo {
    type Held = bool;
    const METAVAR: &'static str = "";

    fn read(text: &str) -> Result<bool, &'static str> {
        text.parse().map_err(|_| "true or false")
    }

    fn write(held: &bool) -> String {
        held.to_string()
    }
}
