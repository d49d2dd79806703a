//! The geometry of the parts: how many configuration frames, how long, in which order.
//!
//! Source: the frame tables of XAPP151, checked against the sizes of real Virtex-E bitstreams.

/// Block type of the frame address register for CLBs, I/O blocks, clocks and the wiring of the block
/// RAMs.
pub const BLOCK_LOGIC: u32 = 0;
/// Block type for the content of the block RAMs.
pub const BLOCK_RAM: u32 = 1;

/// Frames of the clock column, major address 0.
const CLOCK_FRAMES: u32 = 8;
/// Frames of one column of CLBs.
const CLB_FRAMES: u32 = 48;
/// Frames of one column of I/O blocks, of which there are two.
const IOB_FRAMES: u32 = 54;
/// Frames of the wiring of one block RAM column.
const RAM_WIRING_FRAMES: u32 = 27;
/// Frames of the content of one block RAM column.
pub const RAM_FRAMES: u32 = 64;

/// A part of the Virtex-E family.
#[derive(Debug, PartialEq, Eq)]
pub struct Part {
    /// Name as the field knows it.
    pub name: &'static str,
    /// How the header of a `.bit` file calls it in the package we assume.
    pub bit_name: &'static str,
    /// Rows of CLBs.
    pub clb_rows: u32,
    /// Columns of CLBs.
    pub clb_columns: u32,
    /// Columns of block RAM.
    pub ram_columns: u32,
}

/// The turret's FPGA.
pub const XCV300E: Part =
    Part { name: "XCV300E", bit_name: "v300ecs144", clb_rows: 32, clb_columns: 48, ram_columns: 4 };

/// A smaller one, of which a real bitstream's size is known.
pub const XCV50E: Part =
    Part { name: "XCV50E", bit_name: "v50ecs144", clb_rows: 16, clb_columns: 24, ram_columns: 4 };

/// All parts that this crate knows.
pub const PARTS: [&Part; 2] = [&XCV300E, &XCV50E];

/// Where a frame lies, as the frame address register says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameAddress {
    /// [`BLOCK_LOGIC`] or [`BLOCK_RAM`].
    pub block: u32,
    /// The column.
    pub major: u32,
    /// The frame within its column.
    pub minor: u32,
}

impl FrameAddress {
    /// From the register's value: block type 26:25, major 24:17, minor 16:9.
    pub const fn from_far(far: u32) -> Self {
        Self { block: far >> 25 & 3, major: far >> 17 & 0xFF, minor: far >> 9 & 0xFF }
    }

    /// The register's value.
    pub const fn to_far(self) -> u32 {
        self.block << 25 | self.major << 17 | self.minor << 9
    }
}

impl Part {
    /// Value of the frame length register: words of a frame less one.
    pub const fn flr(&self) -> u32 {
        // 18 bits for each row and for the two rows of I/O blocks, in whole words. One word more is
        // the pad at the end of the frame, which FLR does not count.
        (18 * (self.clb_rows + 2)).div_ceil(32)
    }

    /// Words of a frame, its pad word included.
    pub const fn frame_words(&self) -> u32 {
        self.flr() + 1
    }

    /// Columns (major addresses 0..) of the logic block.
    const fn logic_columns(&self) -> u32 {
        1 + self.clb_columns + 2 + self.ram_columns
    }

    /// Frames of one column, or None if there is no such column.
    pub const fn column_frames(&self, block: u32, major: u32) -> Option<u32> {
        let iob = 1 + self.clb_columns;
        match block {
            BLOCK_LOGIC if major == 0 => Some(CLOCK_FRAMES),
            BLOCK_LOGIC if major < iob => Some(CLB_FRAMES),
            BLOCK_LOGIC if major < iob + 2 => Some(IOB_FRAMES),
            BLOCK_LOGIC if major < self.logic_columns() => Some(RAM_WIRING_FRAMES),
            // On Virtex-E the columns of block RAM content count from 1.
            BLOCK_RAM if major >= 1 && major <= self.ram_columns => Some(RAM_FRAMES),
            _ => None,
        }
    }

    /// Frames of the logic block.
    pub const fn logic_frames(&self) -> u32 {
        CLOCK_FRAMES
            + self.clb_columns * CLB_FRAMES
            + 2 * IOB_FRAMES
            + self.ram_columns * RAM_WIRING_FRAMES
    }

    /// All frames of the part.
    pub const fn frames(&self) -> u32 {
        self.logic_frames() + self.ram_columns * RAM_FRAMES
    }

    /// Running number of the frame at `address`: the order in which the part stores them. None if
    /// the part has no such frame.
    pub fn frame_index(&self, address: FrameAddress) -> Option<u32> {
        let frames = self.column_frames(address.block, address.major)?;
        if address.minor >= frames {
            return None;
        }
        let first = match address.block {
            BLOCK_RAM => self.logic_frames() + (address.major - 1) * RAM_FRAMES,
            _ => (0..address.major).filter_map(|m| self.column_frames(BLOCK_LOGIC, m)).sum(),
        };
        Some(first + address.minor)
    }

    /// The frame after `address`, as the address counts up by itself. None after the last one of a
    /// block.
    pub fn next_frame(&self, address: FrameAddress) -> Option<FrameAddress> {
        let next = FrameAddress { minor: address.minor + 1, ..address };
        if self.frame_index(next).is_some() {
            return Some(next);
        }
        let column = FrameAddress { major: address.major + 1, minor: 0, ..address };
        self.frame_index(column).map(|_| column)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_counts_are_those_of_the_data_sheet() {
        assert_eq!(XCV300E.flr(), 20);
        assert_eq!(XCV300E.frame_words(), 21);
        assert_eq!(XCV300E.logic_frames(), 2528);
        assert_eq!(XCV300E.frames(), 2528 + 256);
        assert_eq!(XCV50E.flr(), 11);
    }

    #[test]
    fn the_address_counts_through_every_logic_frame_once() {
        let mut address = Some(FrameAddress::from_far(0));
        let mut count = 0;
        while let Some(at) = address {
            assert_eq!(XCV300E.frame_index(at), Some(count));
            assert_eq!(FrameAddress::from_far(at.to_far()), at);
            count += 1;
            address = XCV300E.next_frame(at);
        }
        assert_eq!(count, 2528);
    }

    #[test]
    fn block_ram_columns_count_from_one() {
        assert_eq!(FrameAddress::from_far(0x0202_0000).major, 1);
        assert_eq!(XCV300E.frame_index(FrameAddress::from_far(0x0200_0000)), None);
        assert_eq!(XCV300E.frame_index(FrameAddress::from_far(0x0202_0000)), Some(2528));
        assert_eq!(XCV300E.frame_index(FrameAddress::from_far(0x0208_7E00)), Some(2783));
        assert_eq!(XCV300E.next_frame(FrameAddress::from_far(0x0208_7E00)), None);
        assert_eq!(XCV300E.frame_index(FrameAddress::from_far(0x020A_0000)), None);
    }
}
