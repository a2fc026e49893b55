// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/design/detail/bounds.hpp>
