//! What the firmware believes, read from the base's memory as khepera-firmware/soccer/belief.h lays
//! it out. The ELF symbol `soccer_belief` is a pointer to it; an image without that symbol, or of
//! another version, has no belief to read.

use core::mem::offset_of;

use common_sys::constants::{SOCCER_BELIEF_VERSION, soccer_belief_t};
use khepera::Base;
use object::{Object, ObjectSymbol};

const SYMBOL: &str = "soccer_belief";

/// Where the belief is.
#[derive(Clone, Copy, Debug)]
pub struct Reader {
    pointer: u32,
}

/// Something on the pitch as it is believed to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Field coordinates: +x towards the goal that the robot attacks.
    pub mm: [f64; 2],
    /// Since it was last seen, in ticks of 10 ms.
    pub age_ticks: i32,
}

/// A belief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belief {
    /// Changes when the belief is renewed.
    pub ticks: i32,
    /// Number of the strategy's state.
    pub state: i32,
    /// The robot's own place, field coordinates.
    pub mm: [f64; 2],
    /// The robot's own heading.
    pub heading_rad: f64,
    /// A goal has told the place since the start.
    pub localised: bool,
    /// The ball, if it is known.
    pub ball: Option<Place>,
    /// The other robot, if it is known.
    pub opponent: Option<Place>,
}

impl Reader {
    /// For a base with this image.
    pub fn new(image: &[u8]) -> Option<Self> {
        let file = object::File::parse(image).ok()?;
        let symbol = file.symbols().find(|symbol| symbol.name() == Ok(SYMBOL))?;
        u32::try_from(symbol.address()).ok().map(|pointer| Self { pointer })
    }

    /// The belief of this base now; None before the firmware has set it up.
    pub fn read(&self, base: &Base) -> Option<Belief> {
        let at = long(base, self.pointer)? as u32;
        let field = |offset: usize| long(base, at.wrapping_add(offset as u32));
        macro_rules! get {
            ($name:ident) => {
                field(offset_of!(soccer_belief_t, $name))?
            };
        }
        if get!(version) != SOCCER_BELIEF_VERSION as i32 {
            return None;
        }
        let mm = |q4: i32| f64::from(q4) / 16.0;
        let place = |known: i32, x_q4, y_q4, age_ticks| {
            (known != 0).then(|| Place { mm: [mm(x_q4), mm(y_q4)], age_ticks })
        };
        Some(Belief {
            ticks: get!(ticks),
            state: get!(state),
            mm: [mm(get!(x_q4)), mm(get!(y_q4))],
            heading_rad: f64::from(get!(heading)) * 2.0 * core::f64::consts::PI / 65536.0,
            localised: get!(localised) != 0,
            ball: place(get!(ball_known), get!(ball_x_q4), get!(ball_y_q4), get!(ball_age_ticks)),
            opponent: place(
                get!(opponent_known),
                get!(opponent_x_q4),
                get!(opponent_y_q4),
                get!(opponent_age_ticks),
            ),
        })
    }
}

fn long(base: &Base, address: u32) -> Option<i32> {
    let [high, low] = [base.peek_word(address)?, base.peek_word(address.wrapping_add(2))?];
    Some((u32::from(high) << 16 | u32::from(low)) as i32)
}

impl Belief {
    /// Range in mm and bearing in radians, left positive, of a place on the field.
    pub fn polar(&self, mm: [f64; 2]) -> (f64, f64) {
        let (dx, dy) = (mm[0] - self.mm[0], mm[1] - self.mm[1]);
        let (sin, cos) = libm::sincos(libm::atan2(dy, dx) - self.heading_rad);
        (libm::hypot(dx, dy), libm::atan2(sin, cos))
    }
}
