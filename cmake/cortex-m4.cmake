# SPDX-License-Identifier: MIT
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(RESONID_CORTEX_M_CORE "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16")
include("${CMAKE_CURRENT_LIST_DIR}/cortex-m.cmake")
