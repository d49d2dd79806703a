//! The device that the chip is by itself, without firmware (TRM chapter 3; the configuration was
//! compared with a dump of real hardware at high speed).

use crate::eeprom::Identity;
use crate::usb::Speed;

/// Identity of a chip without EEPROM, but for the revision.
pub(crate) const BLANK: Identity = Identity { vendor: 0x04B4, product: 0x8613, device: 0 };

const DEVICE: u8 = 1;
const CONFIGURATION: u8 = 2;
const DEVICE_QUALIFIER: u8 = 6;
const OTHER_SPEED: u8 = 7;
const ISOCHRONOUS: u8 = 1;
const BULK: u8 = 2;
const INTERRUPT: u8 = 3;

/// Endpoint addresses of the alternate settings with their types there.
const ALTERNATES: [&[(u8, u8)]; 4] = [
    &[],
    &[(0x01, BULK), (0x81, BULK), (0x02, BULK), (0x04, BULK), (0x86, BULK), (0x88, BULK)],
    &[
        (0x01, INTERRUPT),
        (0x81, INTERRUPT),
        (0x02, INTERRUPT),
        (0x04, BULK),
        (0x86, INTERRUPT),
        (0x88, BULK),
    ],
    &[
        (0x01, INTERRUPT),
        (0x81, INTERRUPT),
        (0x02, ISOCHRONOUS),
        (0x04, BULK),
        (0x86, ISOCHRONOUS),
        (0x88, BULK),
    ],
];

/// Number of alternate settings of its interface.
pub(crate) const ALTERNATE_COUNT: u8 = ALTERNATES.len() as u8;

/// The descriptor that GET_DESCRIPTOR asks for, whole; `None` = STALL. It has no strings.
pub(crate) fn descriptor(kind: u8, index: u8, identity: Identity, speed: Speed) -> Option<Vec<u8>> {
    match (kind, index) {
        (DEVICE, 0) => Some(device(identity)),
        (CONFIGURATION, 0) => Some(configuration(CONFIGURATION, speed)),
        (DEVICE_QUALIFIER, 0) => Some(vec![10, DEVICE_QUALIFIER, 0, 2, 0xFF, 0xFF, 0xFF, 64, 1, 0]),
        (OTHER_SPEED, 0) => Some(configuration(OTHER_SPEED, speed.other())),
        _ => None,
    }
}

fn device(identity: Identity) -> Vec<u8> {
    let mut out = vec![18, DEVICE, 0, 2, 0xFF, 0xFF, 0xFF, 64];
    for word in [identity.vendor, identity.product, identity.device] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    out.extend_from_slice(&[0, 0, 0, 1]);
    out
}

fn configuration(kind: u8, speed: Speed) -> Vec<u8> {
    let mut out = vec![9, kind, 0, 0, 1, 1, 0, 0x80, 50];
    for (alternate, endpoints) in ALTERNATES.iter().enumerate() {
        let count = endpoints.len() as u8;
        out.extend_from_slice(&[9, 4, 0, alternate as u8, count, 0xFF, 0xFF, 0xFF, 0]);
        for &(address, kind) in *endpoints {
            let [low, high] = max_packet(address, kind, speed).to_le_bytes();
            out.extend_from_slice(&[7, 5, address, kind, low, high, u8::from(kind != BULK)]);
        }
    }
    let length = (out.len() as u16).to_le_bytes();
    out[2..4].copy_from_slice(&length);
    out
}

fn max_packet(address: u8, kind: u8, speed: Speed) -> u16 {
    match (speed, kind) {
        (Speed::Full, _) => 64,
        (Speed::High, BULK) => 512,
        (Speed::High, _) if address & 0x0F == 1 => 64,
        (Speed::High, _) => 512,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configuration_has_the_length_and_endpoints_of_real_hardware() {
        let bytes = descriptor(CONFIGURATION, 0, BLANK, Speed::High).unwrap();
        assert_eq!(bytes.len(), 171);
        assert_eq!(bytes[..9], [9, 2, 171, 0, 1, 1, 0, 0x80, 50]);
        // Alternate 1, EP1 OUT: bulk 512; alternate 3, EP2: isochronous 512, interval 1.
        assert_eq!(bytes[27..34], [7, 5, 0x01, 2, 0, 2, 0]);
        let alternate_3 = 9 + 4 * 9 + 12 * 7;
        assert_eq!(bytes[alternate_3 + 14..alternate_3 + 21], [7, 5, 0x02, 1, 0, 2, 1]);
    }

    #[test]
    fn unknown_descriptors_are_refused() {
        assert_eq!(descriptor(3, 0, BLANK, Speed::High), None);
        assert_eq!(descriptor(1, 1, BLANK, Speed::High), None);
    }
}
