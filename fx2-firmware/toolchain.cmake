# sdcc for the 8051 of the FX2.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR mcs51)

find_program(SDCC sdcc)
if(NOT SDCC)
  message(FATAL_ERROR "sdcc is not installed: the FX2 firmware cannot be built. Install Debian's package sdcc.")
endif()
set(CMAKE_C_COMPILER ${SDCC})
# A test program needs the whole memory map to link; a library is enough to see that sdcc works.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

set(CMAKE_C_FLAGS_INIT "-mmcs51 --std-c99 --model-small")
