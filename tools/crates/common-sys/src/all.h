/* What Rust sees of the C side. */
#include "link/bytes.h"
#include "link/crc.h"
#include "link/registers.h"
#include "link/report.h"
#include "link/requests.h"
#include "link/slots.h"
#include "vision/camera.h"
#include "vision/dense.h"
#include "vision/depth.h"
#include "vision/robot_eye.h"

#include "fx2-firmware/board/turret.h"
#include "khepera-firmware/board/khepera.h"
