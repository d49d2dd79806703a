//! Stretches of a row of the picture. What is flat in the world is bounded by straight lines in the
//! picture, so the ends of its stretches can be computed.

use core::ops::Range;

use crate::camera::WIDTH;

/// A value that changes evenly along a row: `start + slope * x`.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// In column 0.
    pub start: f32,
    /// From column to column.
    pub slope: f32,
}

impl Line {
    /// The value in a column.
    pub fn at(self, x: f32) -> f32 {
        self.start + self.slope * x
    }

    /// `sign` times this value, plus `more`.
    pub fn turned(self, sign: f32, more: f32) -> Self {
        Self { start: sign * self.start + more, slope: sign * self.slope }
    }
}

/// From where to where in a row, in pixels; empty if it ends before it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// Its left end.
    pub from: f32,
    /// Its right end.
    pub to: f32,
}

impl Stretch {
    const NOTHING: Self = Self { from: f32::MAX, to: f32::MIN };

    /// What these pixels cover.
    pub fn of(pixels: &Range<usize>) -> Self {
        Self { from: pixels.start as f32 - 0.5, to: pixels.end as f32 - 0.5 }
    }

    /// Whether nothing is in it.
    pub fn is_empty(self) -> bool {
        self.from >= self.to
    }

    /// The part where a value is positive.
    pub fn where_positive(self, value: Line) -> Self {
        if value.slope == 0.0 {
            return if value.start > 0.0 { self } else { Self::NOTHING };
        }
        let zero = -value.start / value.slope;
        if value.slope > 0.0 {
            Self { from: self.from.max(zero), to: self.to }
        } else {
            Self { from: self.from, to: self.to.min(zero) }
        }
    }

    /// The part where a point that moves evenly is nearer than `radius` to `centre`.
    pub fn where_near(self, point: [Line; 2], centre: [f32; 2], radius: f32) -> Self {
        let [x, y] = [point[0].start - centre[0], point[1].start - centre[1]];
        let [dx, dy] = [point[0].slope, point[1].slope];
        let (a, b) = (dx * dx + dy * dy, x * dx + y * dy);
        let root = b * b - a * (x * x + y * y - radius * radius);
        if root <= 0.0 || a <= 0.0 {
            return Self::NOTHING;
        }
        let (middle, half) = (-b / a, root.sqrt() / a);
        Self { from: self.from.max(middle - half), to: self.to.min(middle + half) }
    }

    /// The pixels whose centres lie within. One just at an end belongs to what begins there.
    pub fn pixels(self) -> Range<usize> {
        let first_from = |x: f32| x.clamp(0.0, WIDTH as f32).ceil() as usize;
        let (from, to) = (first_from(self.from), first_from(self.to));
        from..to.max(from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW: Stretch = Stretch { from: -0.5, to: WIDTH as f32 - 0.5 };

    #[test]
    fn neighbours_share_no_pixel_and_leave_none_out() {
        for end in [-3.0, -0.5, 0.0, 0.2, 7.0, 7.5, 318.9, 319.0, 319.5, 900.0] {
            let left = Stretch { to: end, ..ROW }.pixels();
            let right = Stretch { from: end, ..ROW }.pixels();
            assert_eq!(left.len() + right.len(), WIDTH, "cut at {end}");
            assert!(left.is_empty() || right.is_empty() || left.end == right.start);
        }
    }

    #[test]
    fn a_stretch_is_cut_where_a_value_changes_its_sign() {
        let rising = Line { start: -10.0, slope: 2.0 };
        assert_eq!(ROW.where_positive(rising), Stretch { from: 5.0, ..ROW });
        assert_eq!(ROW.where_positive(rising.turned(-1.0, 0.0)), Stretch { to: 5.0, ..ROW });
        assert!(ROW.where_positive(Line { start: -1.0, slope: 0.0 }).is_empty());
    }

    #[test]
    fn a_chord_has_its_length() {
        let point = [Line { start: 0.0, slope: 0.5 }, Line { start: 3.0, slope: 0.0 }];
        let chord = ROW.where_near(point, [50.0, 0.0], 5.0);
        assert!((chord.from - 92.0).abs() < 1e-3 && (chord.to - 108.0).abs() < 1e-3, "{chord:?}");
    }
}
