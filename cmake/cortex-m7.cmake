# SPDX-License-Identifier: MIT
set(CMAKE_SYSTEM_PROCESSOR cortex-m7)
set(RESONID_CORTEX_M_CORE "-mcpu=cortex-m7 -mfpu=fpv5-d16")
include("${CMAKE_CURRENT_LIST_DIR}/cortex-m.cmake")
