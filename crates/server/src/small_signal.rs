//! One small-signal answer of a device, as it travels.

use bimorph_device::{Device, DeviceError, SmallSignal, Token};
use bimorph_wire::convert::device as wire;
use bimorph_wire::proto;

/// A small-signal answer about a state, or what noise there is.
pub(super) fn small_signal(
    device: &mut dyn Device,
    token: Token,
    omega: f64,
    noise: bool,
) -> Result<proto::SmallSignal, DeviceError> {
    if !omega.is_finite() {
        let (expected, got) = ("a finite angular frequency [rad/s]".to_owned(), omega.to_string());
        return Err(DeviceError::BadRequest { what: "omega", expected, got });
    }
    if noise {
        let mut densities = Vec::new();
        device.noise(token, omega, &mut densities)?;
        return Ok(wire::noise_to_wire(&densities));
    }
    let mut answer = SmallSignal::default();
    device.linearize(token, omega, &mut answer)?;
    Ok(wire::small_signal_to_wire(&answer))
}
