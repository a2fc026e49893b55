# SPDX-License-Identifier: MIT
# Cross-compiles for a Cortex-M with FPU by Debian's gcc-arm-none-eabi; cortex-m4.cmake and cortex-m7.cmake set the
# core. A project of its own may use them likewise: cmake --toolchain <resonid>/cmake/cortex-m4.cmake.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # a program would need a linker script
set(CMAKE_C_FLAGS_INIT "${RESONID_CORTEX_M_CORE} -mthumb -mfloat-abi=hard -ffunction-sections -fdata-sections")
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -Wno-psabi")
# Header-only packages of the machine that compiles: Eigen and tl::expected.
list(APPEND CMAKE_PREFIX_PATH /usr)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
