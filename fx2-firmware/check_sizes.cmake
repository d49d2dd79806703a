# Prints what the image takes of the chip's memories, as one table, and fails above a limit.
#   cmake -DMEM= -DCODE_BYTES= -DSCRATCH_BYTES= -DSCRATCH_CONSTANTS= -DSTACK_MIN= -P check_sizes.cmake
# All figures are from the .mem file that sdcc writes.
cmake_minimum_required(VERSION 3.25)

file(READ "${MEM}" mem)

# Its size of the code counts the constants in the scratch RAM too; its last address does not.
if(NOT mem MATCHES "ROM/EPROM/FLASH +0x0000 +0x([0-9a-f]+) ")
  message(FATAL_ERROR "${MEM} does not say how large the code is: is it sdcc's?")
endif()
math(EXPR code "0x${CMAKE_MATCH_1} + 1")
if(NOT mem MATCHES "EXTERNAL RAM +(0x[0-9a-f]+ +0x[0-9a-f]+ +)?([0-9]+) ")
  message(FATAL_ERROR "${MEM} does not say how large the external RAM is: is it sdcc's?")
endif()
math(EXPR scratch "${CMAKE_MATCH_2} + ${SCRATCH_CONSTANTS}")
if(NOT mem MATCHES "Stack starts at: 0x([0-9a-f]+)[^\n]* with ([0-9]+) bytes available")
  message(FATAL_ERROR "${MEM} does not say what is left for the stack: is it sdcc's?")
endif()
math(EXPR iram "0x${CMAKE_MATCH_1}")
set(stack ${CMAKE_MATCH_2})

# `text`, filled up with spaces in front (negative width: behind) to `width` characters.
function(pad out text width)
  string(LENGTH "${text}" length)
  if(width LESS 0)
    math(EXPR fill "-(${width}) - ${length}")
    string(REPEAT " " ${fill} spaces)
    set(${out} "${text}${spaces}" PARENT_SCOPE)
  else()
    math(EXPR fill "${width} - ${length}")
    string(REPEAT " " ${fill} spaces)
    set(${out} "${spaces}${text}" PARENT_SCOPE)
  endif()
endfunction()

function(row name used limit)
  math(EXPR left "${limit} - ${used}")
  pad(name_column "${name}" -26)
  pad(used_column ${used} 8)
  pad(limit_column ${limit} 8)
  pad(left_column ${left} 8)
  message("  ${name_column}${used_column}${limit_column}${left_column}")
  if(left LESS 0)
    message(FATAL_ERROR "${name}: ${used} bytes, but the chip has ${limit}. Make it smaller.")
  endif()
endfunction()

message("fx2-firmware, bytes             used   limit    left")
row("code and constants" ${code} ${CODE_BYTES})
row("scratch RAM" ${scratch} ${SCRATCH_BYTES})
row("internal RAM (variables)" ${iram} 256)
message("  stack: ${stack} bytes")
if(stack LESS STACK_MIN)
  message(FATAL_ERROR "Only ${stack} bytes are left for the stack; it needs ${STACK_MIN}. "
                      "Move variables into XDATA.")
endif()
