//! The host's side of the turret.
//!
//! [`select`] finds robots on USB and running twins, and opens the one that was meant; [`Device`] is
//! what it gives: one USB device, reached through the kernel ([`real`]) or through a twin's usbredir
//! socket ([`redirected`]). Everything above it is the same for both: [`turret`] speaks the requests
//! of the turret's firmware, [`ram`] those of the bare chip, [`eeprom`] those of the program that
//! writes the boot EEPROM. [`registry`] is where running twins say that they are there.

mod device;
pub mod eeprom;
pub mod eyes;
pub mod ram;
pub mod real;
pub mod redirected;
pub mod registry;
pub mod select;
pub mod turret;

pub use device::{BulkReader, Device, Identity, LinkError, Setup};
