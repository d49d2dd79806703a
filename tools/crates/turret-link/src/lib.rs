//! The host's side of the turret.
//!
//! [`select`] finds robots on USB and running twins, and opens the one that was meant; [`Device`] is
//! what it gives: one USB device, reached through the kernel ([`real`]) or through a twin's usbredir
//! socket ([`redirected`]). Everything above it is the same for both. [`registry`] is where running
//! twins say that they are there.

mod device;
pub mod real;
pub mod redirected;
pub mod registry;
pub mod select;

pub use device::{BulkReader, Device, Identity, LinkError, Setup};
