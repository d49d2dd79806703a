//! What our designs bring along for the cameras: registers that a sensor of the OV7670's kind needs to
//! send RGB565 in the size wanted, each as register << 8 | value.
//!
//! Windows and scaling after the data sheet (version 1.4) and the values its users agree on; a real
//! camera's colours may want more.

/// For 320x240 and for 640x480, as the formats are numbered.
pub const ALL: [&[u16]; 2] = [&SMALL, &LARGE];

const SMALL: [u16; 14] = [
    0x1214, // COM7: QVGA, RGB
    0x1100, // CLKRC: the clock as it comes
    0x40D0, // COM15: RGB565, full range
    0x0C04, // COM3: scaling on
    0x3E19, // COM14: pixel clock divided by 2, scaling by hand
    0x7211, // down by 2 each way
    0x73F1, // its clock, divided by 2
    0xA202, // delay of the scaled output
    0x1715, // HSTART
    0x1803, // HSTOP
    0x3280, // HREF
    0x1903, // VSTART
    0x1A7B, // VSTOP
    0x0300, // VREF
];

const LARGE: [u16; 14] = [
    0x1204, // COM7: VGA, RGB
    0x1100, // CLKRC
    0x40D0, // COM15: RGB565, full range
    0x0C00, // COM3: no scaling
    0x3E00, // COM14
    0x7211, // as at reset
    0x73F0, 0xA202, 0x1713, // HSTART
    0x1801, // HSTOP
    0x32B6, // HREF
    0x1902, // VSTART
    0x1A7A, // VSTOP
    0x030A, // VREF
];
