//! `common/link/loader.h` and `common/link/base_image.h`: what the resident loader of the Khepera base
//! takes, over the line and in the flash.

#![allow(unsafe_code)] // calls into C; each with the lengths the header asks for

use crate::ffi;

pub use ffi::{base_image_t as BaseImage, loader_hello_t as Hello};

/// Bytes of an image's header.
pub const BASE_IMAGE_HEADER_SIZE: usize = ffi::BASE_IMAGE_HEADER_SIZE as usize;
/// Most bytes of a frame's payload.
pub const PAYLOAD_MAX: usize = 4 + ffi::LOADER_BLOCK_SIZE as usize;

/// A frame: request or reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// One of `LOADER_*`, with `LOADER_REPLY` in a reply.
    pub kind: u8,
    /// Joins a reply to its request.
    pub sequence: u8,
    /// What goes with it.
    pub payload: Vec<u8>,
}

impl Frame {
    /// The frame's bytes on the wire.
    ///
    /// # Panics
    /// If the payload is longer than [`PAYLOAD_MAX`].
    pub fn encode(&self) -> Vec<u8> {
        assert!(self.payload.len() <= PAYLOAD_MAX, "no frame is that long");
        let mut wire = vec![0; PAYLOAD_MAX + 16];
        // SAFETY: `wire` has room for LOADER_WIRE_MAX bytes, which is less than PAYLOAD_MAX + 16, and
        // the payload is valid for its own length.
        let count = unsafe {
            ffi::loader_frame_encode(
                self.kind,
                self.sequence,
                self.payload.as_ptr(),
                self.payload.len() as u16,
                wire.as_mut_ptr(),
            )
        };
        wire.truncate(usize::from(count));
        wire
    }
}

/// Takes frames together, character by character.
#[derive(Clone)]
pub struct Receiver(ffi::loader_receiver_t);

impl Default for Receiver {
    fn default() -> Self {
        let mut receiver = ffi::loader_receiver_t::default();
        // SAFETY: `receiver` is a valid receiver.
        unsafe { ffi::loader_receiver_init(&mut receiver) };
        Self(receiver)
    }
}

impl Receiver {
    /// The next character; the frame that it ended, if that is whole.
    pub fn take(&mut self, character: u8) -> Option<Frame> {
        let mut size = 0;
        // SAFETY: the receiver was initialised.
        let whole = unsafe { ffi::loader_receive(&mut self.0, character, &mut size) };
        let bytes = &self.0.frame;
        (whole != 0).then(|| Frame {
            kind: bytes[0],
            sequence: bytes[1],
            payload: bytes[2..2 + usize::from(size)].to_vec(),
        })
    }
}

/// What a loader says of itself, if `wire` is as long as that takes.
pub fn hello_decode(wire: &[u8]) -> Option<Hello> {
    if wire.len() != ffi::LOADER_HELLO_SIZE as usize {
        return None;
    }
    let mut hello = Hello::default();
    // SAFETY: `wire` has LOADER_HELLO_SIZE bytes.
    unsafe { ffi::loader_hello_decode(wire.as_ptr(), &mut hello) };
    Some(hello)
}

/// The 64 bytes of an image's header.
pub fn base_image_encode(image: &BaseImage) -> [u8; BASE_IMAGE_HEADER_SIZE] {
    let mut wire = [0; BASE_IMAGE_HEADER_SIZE];
    // SAFETY: `wire` has BASE_IMAGE_HEADER_SIZE bytes.
    unsafe { ffi::base_image_encode(image, wire.as_mut_ptr()) };
    wire
}

/// The image header in `wire`, or None if there is none of a version known here.
pub fn base_image_decode(wire: &[u8; BASE_IMAGE_HEADER_SIZE]) -> Option<BaseImage> {
    let mut image = BaseImage::default();
    // SAFETY: `wire` has BASE_IMAGE_HEADER_SIZE bytes.
    let error = unsafe { ffi::base_image_decode(wire.as_ptr(), &mut image) };
    (error == ffi::base_image_error_t_BASE_IMAGE_OK).then_some(image)
}
