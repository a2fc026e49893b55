// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <matio.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <resonid/io/detail/table.hpp>
#include <string_view>

#include "io/text.hpp"
#include "io/text_source.hpp"

// The HDF5 library, which matio reads version 7.3 with, prints an error stack on standard error unless told
// not to. Weak: a matio without HDF5 has nothing to silence.
extern "C" {
using Hdf5ErrorPrinter = int (*)(std::int64_t stack, void* data);
[[gnu::weak]] int H5Eget_auto2(std::int64_t stack, Hdf5ErrorPrinter* printer, void** data);
[[gnu::weak]] int H5Eset_auto2(std::int64_t stack, Hdf5ErrorPrinter printer, void* data);
}

namespace resonid::io {
namespace {

class QuietHdf5 {
 public:
  QuietHdf5() noexcept {
    if (H5Eget_auto2 == nullptr || H5Eset_auto2 == nullptr) return;
    changed_ = H5Eget_auto2(0, &printer_, &data_) >= 0 && H5Eset_auto2(0, nullptr, nullptr) >= 0;
  }
  QuietHdf5(const QuietHdf5&) = delete;
  QuietHdf5& operator=(const QuietHdf5&) = delete;
  ~QuietHdf5() {
    if (changed_) H5Eset_auto2(0, printer_, data_);
  }

 private:
  Hdf5ErrorPrinter printer_ = nullptr;
  void* data_ = nullptr;
  bool changed_ = false;
};

struct CloseFile {
  void operator()(mat_t* file) const noexcept { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const noexcept { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

std::string_view class_name(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_CELL:
      return "a cell array";
    case MAT_C_STRUCT:
      return "a struct";
    case MAT_C_CHAR:
      return "text";
    case MAT_C_SPARSE:
      return "a sparse matrix";
    case MAT_C_FUNCTION:
      return "a function";
    case MAT_C_OBJECT:
    case MAT_C_OPAQUE:
      return "an object";
    case MAT_C_EMPTY:
      return "empty";
    default:
      return "an array";
  }
}

bool is_numeric(const matvar_t& variable) noexcept {
  return variable.class_type >= MAT_C_DOUBLE && variable.class_type <= MAT_C_UINT64;
}

std::string shape(const matvar_t& variable) {
  std::string text;
  for (int i = 0; i < variable.rank; ++i) text += fmt::format("{}{}", i == 0 ? "" : "x", variable.dims[i]);
  return text;
}

std::size_t elements(const matvar_t& variable) noexcept {
  std::size_t count = variable.rank > 0 ? 1 : 0;
  for (int i = 0; i < variable.rank; ++i) count *= variable.dims[i];
  return count;
}

/// Why the variable is not one real numeric vector or number, as a phrase; empty when it is.
std::string objection(const matvar_t& variable) {
  if (!is_numeric(variable)) return fmt::format("is {} ({})", class_name(variable), shape(variable));
  if (variable.isComplex != 0) return fmt::format("is complex ({})", shape(variable));
  if (elements(variable) == 0) return fmt::format("is empty ({})", shape(variable));
  if (variable.rank != 2 || (variable.dims[0] != 1 && variable.dims[1] != 1))
    return fmt::format("is a matrix ({})", shape(variable));
  return {};
}

template <class Number>
std::vector<double> converted(const matvar_t& variable) {
  const auto* first = static_cast<const Number*>(variable.data);
  std::vector<double> values(elements(variable));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(first[i]);
  return values;
}

/// The data as doubles; matio delivers it in the type of the variable's class.
std::vector<double> values_of(const matvar_t& variable) {
  switch (variable.class_type) {
    case MAT_C_DOUBLE:
      return converted<double>(variable);
    case MAT_C_SINGLE:
      return converted<float>(variable);
    case MAT_C_INT8:
      return converted<std::int8_t>(variable);
    case MAT_C_UINT8:
      return converted<std::uint8_t>(variable);
    case MAT_C_INT16:
      return converted<std::int16_t>(variable);
    case MAT_C_UINT16:
      return converted<std::uint16_t>(variable);
    case MAT_C_INT32:
      return converted<std::int32_t>(variable);
    case MAT_C_UINT32:
      return converted<std::uint32_t>(variable);
    case MAT_C_INT64:
      return converted<std::int64_t>(variable);
    case MAT_C_UINT64:
      return converted<std::uint64_t>(variable);
    default:
      return {};
  }
}

void take(Table& table, const std::string& name, std::vector<double> values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) {
      table.unusable.push_back(
          {name,
           fmt::format("holds {} at element {}; every sample must be a finite number", values[i], i + 1)});
      return;
    }
  if (values.size() == 1) {
    table.scalars.push_back({name, values.front()});
    return;
  }
  table.names.push_back(name);
  table.columns.push_back(std::move(values));
}

std::string description(const std::vector<Table::Unusable>& unusable) {
  std::vector<std::string> phrases;
  for (const auto& variable : unusable) phrases.push_back(in_quotes(variable.name) + ' ' + variable.reason);
  return listed(phrases);
}

}  // namespace

expected<Table, Error> read_mat(const std::filesystem::path& path) {
  const auto source = TextSource::open(path);  // says what is wrong with a file that cannot be opened
  if (!source) return unexpected<Error>(source.error());
  if (source->size() == 0) return fail(path.string(), "the file is empty; a MAT file is required");
  const QuietHdf5 quiet;
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) return fail(path.string(), "is not a MAT file of version 4, 5 or 7.3");
  Table table;
  table.source = path.string();
  while (const Variable variable{Mat_VarReadNextInfo(file.get())}) {
    if (variable->name == nullptr) continue;
    const std::string name = variable->name;
    if (std::string why = objection(*variable); !why.empty()) {
      table.unusable.push_back({name, why + "; one real numeric vector is required"});
    } else if (Mat_VarReadDataAll(file.get(), variable.get()) != 0 || variable->data == nullptr) {
      return fail(path.string(),
                  fmt::format("variable {} cannot be read: the file is damaged", in_quotes(name)));
    } else {
      take(table, name, values_of(*variable));
    }
  }
  if (table.columns.empty() && table.scalars.empty() && table.unusable.empty())
    return fail(path.string(), "holds no variable that can be read: it is empty or damaged");
  if (table.columns.empty()) {
    return fail(
        path.string(),
        fmt::format("no variable is a vector of numbers{}{}; required: one real numeric vector per signal",
                    table.unusable.empty() ? "" : ": ", description(table.unusable)));
  }
  return table;
}

}  // namespace resonid::io
