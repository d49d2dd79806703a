# The 8051, run on this machine by ucsim.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR mcs51)
set(CMAKE_C_COMPILER sdcc)
# Else CMake finds the native ar first, whose archives sdcc cannot link.
find_program(CMAKE_AR sdar REQUIRED)
# Unity does not fit the small model. Without these optimisations its temporaries fit internal RAM.
set(CMAKE_C_FLAGS_INIT
    "-mmcs51 --std-c11 --model-large --nogcse --noinvariant --noinduction --noloopreverse")
set(CMAKE_EXECUTABLE_SUFFIX_C .ihx)
set(CMAKE_CROSSCOMPILING_EMULATOR ${CMAKE_CURRENT_LIST_DIR}/run-s51)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
