//! A device on this machine's USB, through the operating system.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::{Duration, Instant};

use nusb::transfer::TransferError;
use nusb::transfer::{Buffer, Bulk, ControlIn, ControlOut, ControlType, In, Out, Recipient};
use nusb::{DeviceInfo, Endpoint, ErrorKind, Interface, MaybeFuture, Speed};

use crate::device::{Device, Identity, LinkError, Setup};

/// For one control transfer.
const CONTROL_PATIENCE: Duration = Duration::from_secs(5);
/// Between two looks for a device that is to come back.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// What Linux says if sysfs has no USB.
const ENOENT: u32 = 2;
/// Size of the transfers that a long write is made of, and how many are under way.
const WRITE_SIZE: usize = 64 << 10;
const WRITES: usize = 4;

/// What `--robot` takes to mean this device: its serial number, or else where it is plugged in.
pub fn name(info: &DeviceInfo) -> String {
    match info.serial_number() {
        Some(serial) if !serial.is_empty() => format!("usb:{serial}"),
        _ => format!("usb:@{}", socket(info)),
    }
}

/// Where it is plugged in, as the kernel writes it: bus, hub ports.
pub fn socket(info: &DeviceInfo) -> String {
    let ports: Vec<String> = info.port_chain().iter().map(u8::to_string).collect();
    format!("{}-{}", info.bus_id().trim_start_matches('0'), ports.join("."))
}

/// Who a listed device is.
pub fn identity(info: &DeviceInfo) -> Identity {
    Identity {
        name: name(info),
        vendor: info.vendor_id(),
        product: info.product_id(),
        release: info.device_version(),
        serial: info.serial_number().filter(|serial| !serial.is_empty()).map(str::to_owned),
        high_speed: matches!(info.speed(), Some(Speed::High | Speed::Super | Speed::SuperPlus)),
    }
}

/// All USB devices.
///
/// # Errors
/// If the system cannot list them.
pub fn all() -> Result<Vec<DeviceInfo>, LinkError> {
    match nusb::list_devices().wait() {
        Ok(devices) => Ok(devices.collect()),
        // A machine without USB has no devices.
        Err(error) if error.kind() == ErrorKind::NotFound || error.os_error() == Some(ENOENT) => {
            Ok(Vec::new())
        }
        Err(error) => Err(LinkError::Other(format!("cannot list USB devices: {error}"))),
    }
}

/// An open device.
pub struct Real {
    info: DeviceInfo,
    identity: Identity,
    interface: Interface,
    readers: BTreeMap<u8, Endpoint<Bulk, In>>,
}

impl Real {
    /// Opens a listed device and claims its interface 0.
    ///
    /// # Errors
    /// If that is not allowed, or another program has it.
    pub fn open(info: DeviceInfo) -> Result<Self, LinkError> {
        let name = name(&info);
        let not_opened = |error: nusb::Error| not_opened(error.kind(), &name, &error);
        let device = info.open().wait().map_err(not_opened)?;
        let interface = device.claim_interface(0).wait().map_err(not_opened)?;
        let identity = identity(&info);
        Ok(Self { info, identity, interface, readers: BTreeMap::new() })
    }

    fn reader(&mut self, endpoint: u8) -> Result<&mut Endpoint<Bulk, In>, LinkError> {
        if !self.readers.contains_key(&endpoint) {
            let opened = self.interface.endpoint::<Bulk, In>(endpoint).map_err(no_endpoint)?;
            self.readers.insert(endpoint, opened);
        }
        self.readers.get_mut(&endpoint).ok_or(LinkError::Gone)
    }
}

/// Why the device `name` cannot be used, from what the system says.
fn not_opened(kind: ErrorKind, name: &str, said: &dyn Display) -> LinkError {
    match kind {
        ErrorKind::PermissionDenied => LinkError::Permission(name.to_owned()),
        ErrorKind::Busy => LinkError::Busy(name.to_owned()),
        ErrorKind::Disconnected | ErrorKind::NotFound => LinkError::Gone,
        _ => LinkError::Other(format!("cannot use {name}: {said}")),
    }
}

fn no_endpoint(error: nusb::Error) -> LinkError {
    match error.kind() {
        ErrorKind::Disconnected => LinkError::Gone,
        _ => LinkError::Other(format!(
            "there is no such endpoint in this alternate setting: {error}"
        )),
    }
}

fn failed(error: TransferError, patience: Duration) -> LinkError {
    match error {
        TransferError::Stall => LinkError::Refused,
        TransferError::Cancelled => LinkError::Timeout(patience.as_secs_f64()),
        TransferError::Disconnected => LinkError::Gone,
        other => LinkError::Other(format!("the USB transfer failed: {other}")),
    }
}

fn refused(kind: ErrorKind) -> LinkError {
    match kind {
        ErrorKind::Disconnected | ErrorKind::NotFound => LinkError::Gone,
        _ => LinkError::Refused,
    }
}

fn control_type(kind: u8) -> ControlType {
    match kind >> 5 & 3 {
        0 => ControlType::Standard,
        1 => ControlType::Class,
        _ => ControlType::Vendor,
    }
}

fn recipient(kind: u8) -> Recipient {
    match kind & 0x1F {
        0 => Recipient::Device,
        1 => Recipient::Interface,
        2 => Recipient::Endpoint,
        _ => Recipient::Other,
    }
}

impl Device for Real {
    fn identity(&self) -> &Identity {
        &self.identity
    }

    fn control_in(&mut self, setup: Setup, length: u16) -> Result<Vec<u8>, LinkError> {
        let request = ControlIn {
            control_type: control_type(setup.kind),
            recipient: recipient(setup.kind),
            request: setup.request,
            value: setup.value,
            index: setup.index,
            length,
        };
        let done = self.interface.control_in(request, CONTROL_PATIENCE).wait();
        done.map_err(|error| failed(error, CONTROL_PATIENCE))
    }

    fn control_out(&mut self, setup: Setup, data: &[u8]) -> Result<(), LinkError> {
        let request = ControlOut {
            control_type: control_type(setup.kind),
            recipient: recipient(setup.kind),
            request: setup.request,
            value: setup.value,
            index: setup.index,
            data,
        };
        let done = self.interface.control_out(request, CONTROL_PATIENCE).wait();
        done.map_err(|error| failed(error, CONTROL_PATIENCE))
    }

    fn set_alternate(&mut self, setting: u8) -> Result<(), LinkError> {
        self.readers.clear();
        self.interface.set_alt_setting(setting).wait().map_err(|error| refused(error.kind()))
    }

    fn clear_halt(&mut self, endpoint: u8) -> Result<(), LinkError> {
        let cleared = if endpoint & 0x80 != 0 {
            self.reader(endpoint)?.clear_halt().wait()
        } else {
            let opened = self.interface.endpoint::<Bulk, Out>(endpoint);
            opened.map_err(no_endpoint)?.clear_halt().wait()
        };
        cleared.map_err(|error| refused(error.kind()))
    }

    fn bulk_out(&mut self, endpoint: u8, data: &[u8], patience: Duration) -> Result<(), LinkError> {
        let mut writer = self.interface.endpoint::<Bulk, Out>(endpoint).map_err(no_endpoint)?;
        let mut chunks = data.chunks(WRITE_SIZE);
        let mut result = Ok(());
        while result.is_ok() {
            if writer.pending() < WRITES
                && let Some(chunk) = chunks.next()
            {
                writer.submit(Buffer::from(chunk));
                continue;
            }
            if writer.pending() == 0 {
                return Ok(());
            }
            result = match writer.wait_next_complete(patience) {
                Some(done) => done.status.map_err(|error| failed(error, patience)),
                None => Err(LinkError::Timeout(patience.as_secs_f64())),
            };
        }
        // Those behind the one that failed must not be written.
        writer.cancel_all();
        while writer.pending() > 0 && writer.wait_next_complete(CONTROL_PATIENCE).is_some() {}
        result
    }

    fn submit_read(&mut self, endpoint: u8, length: usize) -> Result<(), LinkError> {
        self.reader(endpoint)?.submit(Buffer::new(length));
        Ok(())
    }

    fn next_read(
        &mut self,
        endpoint: u8,
        patience: Duration,
    ) -> Result<Option<Vec<u8>>, LinkError> {
        let reader = self.reader(endpoint)?;
        if reader.pending() == 0 {
            return Ok(None);
        }
        let Some(done) = reader.wait_next_complete(patience) else { return Ok(None) };
        done.status.map_err(|error| failed(error, patience))?;
        Ok(Some(done.buffer.into_vec()))
    }

    fn cancel_reads(&mut self, endpoint: u8) -> Result<(), LinkError> {
        if let Some(mut reader) = self.readers.remove(&endpoint) {
            reader.cancel_all();
            while reader.pending() > 0 && reader.wait_next_complete(CONTROL_PATIENCE).is_some() {}
        }
        Ok(())
    }

    fn wait_for_return(&mut self, patience: Duration) -> Result<(), LinkError> {
        self.readers.clear();
        let (socket, address) = (socket(&self.info), self.info.device_address());
        let end = Instant::now() + patience;
        loop {
            let back = all()?
                .into_iter()
                .find(|info| self::socket(info) == socket && info.device_address() != address);
            match back.map(Self::open) {
                Some(Ok(device)) => {
                    *self = device;
                    return Ok(());
                }
                // udev may need a moment to give it to us.
                Some(Err(error @ LinkError::Permission(_))) if Instant::now() >= end => {
                    return Err(error);
                }
                Some(Err(LinkError::Permission(_) | LinkError::Gone)) | None => {}
                Some(Err(error)) => return Err(error),
            }
            if Instant::now() >= end {
                return Err(LinkError::NotBack(patience.as_secs()));
            }
            std::thread::sleep(LOOK_PERIOD);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_refuses_is_told_with_its_cure() {
        let said = |kind| not_opened(kind, "usb:SOT1", &"odd").to_string();
        let denied = said(ErrorKind::PermissionDenied);
        assert!(denied.contains("usb:SOT1") && denied.contains("99-stereosot.rules"), "{denied}");
        assert!(said(ErrorKind::Busy).contains("another program"));
        assert!(said(ErrorKind::Disconnected).contains("gone"));
        assert!(said(ErrorKind::NotFound).contains("gone"));
        assert_eq!(said(ErrorKind::Unsupported), "cannot use usb:SOT1: odd");
    }

    #[test]
    fn a_pulled_cable_is_no_stall_and_no_time_out() {
        let failed = |error| failed(error, Duration::from_secs(2));
        assert!(matches!(failed(TransferError::Disconnected), LinkError::Gone));
        assert!(matches!(failed(TransferError::Stall), LinkError::Refused));
        assert!(matches!(failed(TransferError::Cancelled), LinkError::Timeout(2.0)));
        assert!(matches!(failed(TransferError::Fault), LinkError::Other(_)));
        for kind in [ErrorKind::Disconnected, ErrorKind::NotFound] {
            assert!(matches!(refused(kind), LinkError::Gone), "{kind:?}");
        }
        assert!(matches!(refused(ErrorKind::Other), LinkError::Refused));
    }
}
