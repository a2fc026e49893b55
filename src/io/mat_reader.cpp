// SPDX-License-Identifier: MIT
#include <fmt/core.h>
#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <resonid/io/detail/table.hpp>
#include <string_view>

#include "io/csv_reader.hpp"
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

/// Bytes in memory that have a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("record", MFD_CLOEXEC)) {
    while (descriptor_ >= 0 && !bytes.empty()) {
      const ::ssize_t put = ::write(descriptor_, bytes.data(), bytes.size());
      if (put <= 0) break;
      bytes.remove_prefix(static_cast<std::size_t>(put));
    }
    complete_ = descriptor_ >= 0 && bytes.empty();
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  /// Empty where there was no memory.
  [[nodiscard]] std::string path() const {
    return complete_ ? fmt::format("/proc/self/fd/{}", descriptor_) : "";
  }

 private:
  int descriptor_ = -1;
  bool complete_ = false;
};

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

/// The largest number that there is, where the dimensions multiply to more.
std::size_t elements(const matvar_t& variable) noexcept {
  constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max();
  std::size_t count = variable.rank > 0 ? 1 : 0;
  for (int i = 0; i < variable.rank; ++i) {
    if (variable.dims[i] != 0 && count > kMost / variable.dims[i]) return kMost;
    count *= variable.dims[i];
  }
  return count;
}

/// Whether a file of this size can hold the variable: matio takes memory for what the header claims.
bool fits(const matvar_t& variable, std::size_t file_bytes) noexcept {
  constexpr std::size_t kMostPerByte =
      1100;  // elements of one byte: deflate shrinks no further than 1032 times
  return elements(variable) / kMostPerByte <= file_bytes;
}

constexpr std::size_t kMostColumns = 64;  // that a matrix is taken apart into
constexpr int kMostNested = 8;            // structures in structures

bool is_vector(const matvar_t& v) noexcept { return v.rank == 2 && (v.dims[0] == 1 || v.dims[1] == 1); }
bool is_table(const matvar_t& v) noexcept {
  return v.rank == 2 && std::min(v.dims[0], v.dims[1]) <= kMostColumns && v.dims[0] != v.dims[1];
}

/// Why the variable is no vector, number or table of them, as a phrase; empty when it is.
std::string objection(const matvar_t& variable) {
  if (variable.class_type == MAT_C_OPAQUE || variable.class_type == MAT_C_OBJECT)
    return "is an object, such as a timeseries, which only MATLAB can read: save its numbers, t = ts.Time; y "
           "= ts.Data";
  if (!is_numeric(variable)) return fmt::format("is {} ({})", class_name(variable), shape(variable));
  if (variable.isComplex != 0) return fmt::format("is complex ({})", shape(variable));
  if (elements(variable) == 0) return fmt::format("is empty ({})", shape(variable));
  if (!is_vector(variable) && !is_table(variable)) return fmt::format("is a matrix ({})", shape(variable));
  return {};
}

template <class Number>
std::vector<double> converted(const matvar_t& variable) {
  const auto* first = static_cast<const Number*>(variable.data);
  std::vector<double> values(elements(variable));
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(first[i]);
  return values;
}

/// Of an element of the variable's class, as matio delivers it.
std::size_t bytes_of(const matvar_t& variable) noexcept {
  return std::max<std::size_t>(Mat_SizeOfClass(variable.class_type), 1);
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

void take_vector(Table& table, const std::string& name, std::vector<double> values) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isinf(values[i])) {
      table.unusable.push_back(
          {name,
           fmt::format("holds {} at element {}; every sample must be a finite number", values[i], i + 1)});
      return;
    }
  if (values.size() == 1) {
    if (std::isfinite(values.front())) table.scalars.push_back({name, values.front()});
    return;
  }
  if (std::all_of(values.begin(), values.end(), [](double x) { return std::isnan(x); })) {
    table.unusable.push_back({name, "holds no numbers, NaN only"});
    return;
  }
  table.names.push_back(name);
  table.columns.push_back(std::move(values));
}

/// A vector as it is, a matrix as the vectors along its longer side, `name_1`, `name_2` ...
void take(Table& table, const std::string& name, const matvar_t& variable) {
  const std::vector<double> values = values_of(variable);
  if (is_vector(variable)) return take_vector(table, name, values);
  const std::size_t rows = variable.dims[0], columns = variable.dims[1];
  const bool along_rows = rows > columns;
  const std::size_t count = std::min(rows, columns), length = std::max(rows, columns);
  for (std::size_t c = 0; c < count; ++c) {
    std::vector<double> column(length);
    for (std::size_t k = 0; k < length; ++k)
      column[k] = along_rows ? values[c * rows + k] : values[k * rows + c];
    take_vector(table, fmt::format("{}_{}", name, c + 1), std::move(column));
  }
}

/// Whether a file of this size can hold the variable and all that is nested in it.
bool all_fit(const matvar_t& variable, std::size_t file_bytes, int depth = 0) noexcept {
  if (!fits(variable, file_bytes) || depth > kMostNested) return false;
  if (variable.class_type != MAT_C_STRUCT || variable.data == nullptr) return true;
  const auto* const* fields = static_cast<const matvar_t* const*>(variable.data);
  const std::size_t count = elements(variable) * Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
  for (std::size_t i = 0; i < count; ++i)
    if (fields[i] != nullptr && !all_fit(*fields[i], file_bytes, depth + 1)) return false;
  return true;
}

class VariableReader {
 public:
  VariableReader(Table& table, mat_t* file, std::size_t file_bytes)
      : table_(table), file_(file), bytes_(file_bytes) {}

  /// False where the file is damaged.
  bool read(const std::string& name, matvar_t& variable) {
    const bool structure = variable.class_type == MAT_C_STRUCT;
    if (std::string why = structure ? std::string() : objection(variable); !why.empty()) {
      table_.unusable.push_back({name, why + "; one real numeric vector is required"});
      return true;
    }
    if (!all_fit(variable, bytes_) || Mat_VarReadDataAll(file_, &variable) != 0) return false;
    if (structure || !is_vector(variable))
      table_.unusable.push_back(
          {name, fmt::format("is {} ({}); name one of its {}, {}{}", structure ? "a struct" : "a matrix",
                             shape(variable), structure ? "fields" : "columns", name,
                             structure ? ".FIELD" : "_1 ...")});
    return structure ? read_fields(name, variable, 0) : read_numbers(name, variable);
  }

 private:
  bool read_numbers(const std::string& name, const matvar_t& variable) {
    if (variable.data == nullptr || variable.nbytes / bytes_of(variable) < elements(variable)) return false;
    take(table_, name, variable);
    return true;
  }

  /// What a field `label` says, Simulink's name of a signal; empty where there is none.
  static std::string label_of(const matvar_t& structure, std::size_t element) {
    const matvar_t* label = Mat_VarGetStructFieldByName(const_cast<matvar_t*>(&structure), "label", element);
    if (label == nullptr || label->class_type != MAT_C_CHAR || label->data == nullptr) return {};
    std::string text;
    const std::size_t count = std::min<std::size_t>(elements(*label), label->nbytes);
    for (std::size_t i = 0; i < count; ++i) {
      const char c = label->data_size == 2
                         ? static_cast<char>(static_cast<const std::uint16_t*>(label->data)[i])
                         : static_cast<const char*>(label->data)[i];
      if (c != '\0') text.push_back(c);
    }
    return text;
  }

  bool read_fields(const std::string& name, const matvar_t& structure, int depth) {
    if (structure.data == nullptr || depth > kMostNested) return true;
    auto* const changeable = const_cast<matvar_t*>(&structure);
    const std::size_t count = Mat_VarGetNumberOfFields(changeable);
    char* const* names = Mat_VarGetStructFieldnames(changeable);
    for (std::size_t element = 0; element < elements(structure); ++element)
      for (std::size_t i = 0; i < count; ++i) {
        const matvar_t* field = Mat_VarGetStructFieldByIndex(changeable, i, element);
        if (field == nullptr) continue;
        const std::string label = label_of(structure, element);
        const bool values = std::string_view(names[i]) == "values";
        std::string full = values && !label.empty() ? label : name + "." + names[i];
        if (label.empty() && elements(structure) > 1) full += fmt::format("_{}", element + 1);
        if (field->class_type == MAT_C_STRUCT) {
          if (!read_fields(full, *field, depth + 1)) return false;
        } else if (std::string why = objection(*field); !why.empty()) {
          table_.unusable.push_back({full, why + "; one real numeric vector is required"});
        } else if (!read_numbers(full, *field)) {
          return false;
        }
      }
    return true;
  }

  Table& table_;
  mat_t* file_;
  std::size_t bytes_;
};

/// `run.torque` is called `torque` where no other structure has a field of that name.
void shorten_names(Table& table) {
  const auto ending = [](const std::string& name) { return name.substr(name.rfind('.') + 1); };
  std::vector<std::string> all;
  for (const auto& name : table.names) all.push_back(ending(name));
  for (const auto& scalar : table.scalars) all.push_back(ending(scalar.name));
  for (auto& name : table.names)
    if (std::count(all.begin(), all.end(), ending(name)) == 1) name = ending(name);
  for (auto& scalar : table.scalars)
    if (std::count(all.begin(), all.end(), ending(scalar.name)) == 1) scalar.name = ending(scalar.name);
  for (std::size_t i = 0; i < table.names.size(); ++i)
    for (std::size_t k = 2;
         std::count(table.names.begin(), table.names.begin() + static_cast<std::ptrdiff_t>(i),
                    table.names[i]) > 0;
         ++k)
      table.names[i] = fmt::format("{}#{}", table.names[i], k);
}

std::string description(const std::vector<Table::Unusable>& unusable) {
  std::vector<std::string> phrases;
  for (const auto& variable : unusable) phrases.push_back(in_quotes(variable.name) + ' ' + variable.reason);
  return listed(phrases);
}

/// Whether a file of version 5 ends where its last variable does: each begins with its type and its length in
/// bytes. matio takes a shorter variable as it is.
expected<bool, Error> is_complete(const TextSource& source) {
  constexpr std::size_t kHead = 128, kTag = 8, kEndian = 126;
  std::string head(kHead, '\0');
  const auto got = source.read(0, head.data(), head.size());
  if (!got) return unexpected<Error>(got.error());
  if (*got < kHead || !head.starts_with("MATLAB 5.0")) return true;
  const bool little = head[kEndian] == 'I';
  for (std::size_t offset = kHead; offset < source.size();) {
    std::array<char, kTag> tag{};
    const auto read = source.read(offset, tag.data(), tag.size());
    if (!read) return unexpected<Error>(read.error());
    if (*read < kTag) return false;
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i)
      length = (length << 8U) | static_cast<std::uint8_t>(tag[little ? kTag - 1 - i : 4 + i]);
    offset += kTag + length;
    if (offset > source.size()) return false;
  }
  return true;
}

}  // namespace

expected<Table, Error> read_mat(const TextSource& source, const std::filesystem::path& path) {
  if (source.size() == 0) return fail(source.name(), "the file is empty; a MAT file is required");
  const auto complete = is_complete(source);
  if (!complete) return unexpected<Error>(complete.error());
  if (!*complete)
    return fail(source.name(), "is damaged: it ends in the middle of a variable; export it again");
  const QuietHdf5 quiet;
  // What was unpacked or came through a pipe has no file that matio could open.
  std::optional<MemoryFile> memory;
  if (!source.memory().empty()) memory.emplace(source.memory());
  if (memory && memory->path().empty()) return fail(source.name(), "cannot be unpacked: no memory");
  const std::string opened = memory ? memory->path() : path.string();
  const std::unique_ptr<mat_t, CloseFile> file(Mat_Open(opened.c_str(), MAT_ACC_RDONLY));
  if (!file) return fail(source.name(), "is not a MAT file of version 4, 5 or 7.3");
  Table table;
  table.source = source.name();
  VariableReader reader(table, file.get(), source.size());
  while (const Variable variable{Mat_VarReadNextInfo(file.get())}) {
    if (variable->name == nullptr) continue;
    const std::string name = variable->name;
    if (!reader.read(name, *variable))
      return fail(source.name(),
                  fmt::format("variable {} cannot be read: the file is damaged", in_quotes(name)));
  }
  if (table.columns.empty() && table.scalars.empty() && table.unusable.empty())
    return fail(source.name(),
                "holds no variable that can be read: it is empty or damaged, or holds objects (timeseries, "
                "table) that only "
                "MATLAB reads; save vectors, t = ts.Time; y = ts.Data");
  if (table.columns.empty()) {
    return fail(
        source.name(),
        fmt::format("no variable is a vector of numbers{}{}; required: one real numeric vector per signal",
                    table.unusable.empty() ? "" : ": ", description(table.unusable)));
  }
  shorten_names(table);
  return table;
}

expected<Table, Error> read_mat(const std::filesystem::path& path) {
  const auto source = TextSource::open(path);  // says what is wrong with a file that cannot be opened
  if (!source) return unexpected<Error>(source.error());
  return read_mat(*source, path);
}

}  // namespace resonid::io
