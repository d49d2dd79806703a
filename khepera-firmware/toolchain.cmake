# Cross compiler of the Khepera base: m68k-elf-gcc if there, else Debian's m68k-linux-gnu-gcc.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR m68k)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)

find_program(M68K_GCC NAMES m68k-elf-gcc m68k-linux-gnu-gcc)
if(NOT M68K_GCC)
    message(FATAL_ERROR "No compiler for the 68331. Install Debian's gcc-m68k-linux-gnu, or put "
                        "m68k-elf-gcc into the PATH.")
endif()
string(REGEX REPLACE "gcc$" "" M68K_PREFIX "${M68K_GCC}")
set(CMAKE_C_COMPILER "${M68K_GCC}")
set(CMAKE_ASM_COMPILER "${M68K_GCC}")
set(CMAKE_OBJCOPY "${M68K_PREFIX}objcopy" CACHE FILEPATH "")
set(CMAKE_OBJDUMP "${M68K_PREFIX}objdump" CACHE FILEPATH "")
set(CMAKE_NM "${M68K_PREFIX}nm" CACHE FILEPATH "")

# GCC knows the 68331 by its sibling's name: both have a CPU32 core.
set(CMAKE_C_FLAGS_INIT "-mcpu=68332")
set(CMAKE_ASM_FLAGS_INIT "-mcpu=68332")
