// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

namespace resonid::io {

/// Tables of one kind that the file names: `[axis.x]`, `[axis.y]`. Each begins as `standard`, which
/// describe() may set from what it has read before.
template <class Table>
struct NamedTables {
  Table standard{};
  std::map<std::string, Table> tables{};
};

template <class Field>
inline constexpr bool kIsNamedTables = false;
template <class Table>
inline constexpr bool kIsNamedTables<NamedTables<Table>> = true;

}  // namespace resonid::io
