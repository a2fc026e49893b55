// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <new>
#include <type_traits>

#include "error.hpp"

namespace resonid::c {

inline constexpr std::uint32_t kHandle = 0x64697352;    // "Rsid"
inline constexpr std::uint32_t kSnapshot = 0x73697352;  // "Rsis": no handle until it was checked
inline constexpr std::uint32_t kVersion =
    RESONID_VERSION_MAJOR * 65536 + RESONID_VERSION_MINOR * 256 + RESONID_VERSION_PATCH;

/// What every handle and snapshot begins with; the estimator follows.
struct alignas(RESONID_ALIGNMENT) Header {
  std::uint32_t magic;
  std::uint32_t version;  ///< Of the library: the layout of the estimators may change with any.
  std::uint32_t kind;
  std::uint32_t variant;   ///< Which of the family's types follows.
  std::uint64_t size;      ///< Header included.
  std::uint32_t checksum;  ///< Of a snapshot, with this field 0: CRC-32 of all `size` bytes.
  std::uint32_t reserved[9];
};
static_assert(sizeof(Header) == RESONID_ALIGNMENT);

[[nodiscard]] constexpr std::uint32_t family_of(std::uint32_t kind) noexcept { return kind >> 8; }
[[nodiscard]] constexpr std::uint32_t type_of(std::uint32_t kind) noexcept { return kind & 0xFF; }

/// What one type of estimator can do; null: it cannot. Addresses are those of the handle.
struct Operations {
  std::size_t size = 0;                   // of the handle
  std::uint32_t parameters = 0;           // that parameters() gives
  bool needs_u = true, needs_ru = false;  // of runs
  void (*reset)(void*) noexcept = nullptr;
  void (*miss)(void*, std::uint64_t) noexcept = nullptr;
  void (*step)(void*, double ru, double u, double y) noexcept = nullptr;
  void (*run)(void*, const double* ru, const double* u, const double* y, std::size_t) noexcept = nullptr;
  void (*run_float)(void*, const float* ru, const float* u, const float* y, std::size_t) noexcept = nullptr;
  void (*read)(const void*, void* results) noexcept = nullptr;
  void (*get_parameters)(const void*, double*) noexcept = nullptr;
  void (*get_covariance)(const void*, double*) noexcept = nullptr;
  double (*lag_samples)(const void*) noexcept = nullptr;
  bool (*intact)(const void*) noexcept = nullptr;  // whether the state is one that steps can leave
};

/// The kinds that share one struct of settings and one of results.
struct Family {
  std::uint32_t id, types;  // kinds are 256 id + 0 ... types - 1
  resonid_status (*defaults)(resonid_settings*, std::size_t size, std::uint32_t kind) noexcept;
  std::size_t (*size)(const resonid_settings*) noexcept;
  resonid_status (*init)(void*, std::size_t room, const resonid_settings*, resonid_error*) noexcept;
  resonid_status (*read)(const Operations&, const Header&, resonid_results*, std::size_t size) noexcept;
  const Operations* (*operations)(std::uint32_t variant) noexcept;  // null: no such variant
};
extern const Family kExcitation, kLineBank, kTracker, kResponse, kRls, kModel, kPhysical, kChange, kGuard,
    kEncoder, kAxis, kControl;

/// resonid_stop() of an axis.
resonid_status stop_axis(resonid_handle* handle) noexcept;

/// Null when the kind's family does not exist.
const Family* family(std::uint32_t kind) noexcept;

/// Whether there is a handle at the address.
inline resonid_status check_handle(const void* memory) noexcept {
  if (memory == nullptr) return RESONID_ERROR_NULL;
  if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0) return RESONID_ERROR_ALIGNMENT;
  const Header& h = *static_cast<const Header*>(memory);
  return h.magic == kHandle && h.version == kVersion ? RESONID_OK : RESONID_ERROR_HANDLE;
}
/// What a header that was found good can do; null when its type does not exist or has another size.
inline const Operations* operations_of(const Header& h) noexcept {
  const Family* f = family(h.kind);
  const Operations* o = f != nullptr && type_of(h.kind) < f->types ? f->operations(h.variant) : nullptr;
  return o != nullptr && o->size == h.size ? o : nullptr;
}
/// f(operations) of the handle gives a status.
template <class F>
resonid_status with(const resonid_handle* handle, F&& f) noexcept {
  if (const resonid_status status = check_handle(handle)) return status;
  const Operations* o = operations_of(*reinterpret_cast<const Header*>(handle));
  return o != nullptr ? f(*o) : RESONID_ERROR_HANDLE;
}

template <class T>
[[nodiscard]] constexpr std::size_t handle_size() noexcept {
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= RESONID_ALIGNMENT);
  return sizeof(Header) + (sizeof(T) + RESONID_ALIGNMENT - 1) / RESONID_ALIGNMENT * RESONID_ALIGNMENT;
}
template <class T>
[[nodiscard]] T& content(void* handle) noexcept {
  return *std::launder(reinterpret_cast<T*>(static_cast<unsigned char*>(handle) + sizeof(Header)));
}
template <class T>
[[nodiscard]] const T& content(const void* handle) noexcept {
  return *std::launder(
      reinterpret_cast<const T*>(static_cast<const unsigned char*>(handle) + sizeof(Header)));
}

/// Puts a header and an estimator into memory that was found large enough; nothing of what was there
/// before shows beside what they leave out.
template <class T>
void place(void* memory, std::uint32_t kind, std::uint32_t variant, const T& estimator) noexcept {
  std::memset(memory, 0, handle_size<T>());
  ::new (memory) Header{kHandle, kVersion, kind, variant, handle_size<T>(), 0, {}};
  ::new (static_cast<unsigned char*>(memory) + sizeof(Header)) T(estimator);
}
/// The same of what create() gave, or its error.
template <class T>
expected<void> place(void* memory, std::uint32_t kind, std::uint32_t variant,
                     const expected<T>& made) noexcept {
  if (!made) return unexpected<Error>(made.error());
  place(memory, kind, variant, *made);
  return {};
}

template <class F, class T, class Input>
void run(void* handle, const Input* ru, const Input* u, const Input* y, std::size_t count) noexcept {
  const auto at = [](const Input* x, std::size_t k) {
    return x != nullptr ? static_cast<double>(x[k]) : 0.0;
  };
  T& estimator = content<T>(handle);
  for (std::size_t k = 0; k < count; ++k) F::step(estimator, at(ru, k), at(u, k), at(y, k));
}

/// What F, which describes a family, can do with the type T: F::results(estimator, results), and F::step,
/// F::parameters, F::covariance where the type has them.
template <class F, class T>
[[nodiscard]] constexpr Operations operations_for() noexcept {
  Operations o;
  o.size = handle_size<T>();
  o.reset = [](void* h) noexcept { content<T>(h).reset(); };
  o.intact = [](const void* h) noexcept { return content<T>(h).intact(); };
  o.read = [](const void* h, void* results) noexcept {
    F::results(content<T>(h), *static_cast<typename F::Results*>(results));
  };
  if constexpr (requires(T & t) { t.miss(std::uint64_t{}); })
    o.miss = [](void* h, std::uint64_t count) noexcept { content<T>(h).miss(count); };
  if constexpr (requires(T & t) { F::step(t, 0.0, 0.0, 0.0); }) {
    o.step = [](void* h, double ru, double u, double y) noexcept { F::step(content<T>(h), ru, u, y); };
    o.run = &run<F, T, double>;
    o.run_float = &run<F, T, float>;
    if constexpr (requires { F::template kNeedsRu<T>; }) o.needs_ru = F::template kNeedsRu<T>;
    if constexpr (requires { F::kNeedsU; }) o.needs_u = F::kNeedsU;
  }
  if constexpr (requires(const T& t, double* out) { F::parameters(t, out); }) {
    o.parameters = F::template kParameters<T>;
    o.get_parameters = [](const void* h, double* out) noexcept { F::parameters(content<T>(h), out); };
    o.get_covariance = [](const void* h, double* out) noexcept { F::covariance(content<T>(h), out); };
  }
  if constexpr (requires(const T& t) { F::lag_samples(t); })
    o.lag_samples = [](const void* h) noexcept { return F::lag_samples(content<T>(h)); };
  return o;
}

/// The kind that the settings say, 0 where there is none.
inline std::uint32_t kind_of(const resonid_settings* settings) noexcept {
  return settings != nullptr && settings->struct_size >= sizeof *settings ? settings->kind : 0;
}

/// The caller's settings over the defaults of their kind. Of a longer struct than this library knows, the
/// rest must be 0: a newer caller that asks for what is not there is refused.
template <class F>
resonid_status take(const resonid_settings* given, typename F::Settings& settings,
                    resonid_error* error) noexcept {
  using Settings = typename F::Settings;
  const std::size_t size = given->struct_size;
  if (!possible_size<Settings>(size))
    return fail(error, RESONID_ERROR_SIZE, "struct_size", "must be set by resonid_defaults()");
  settings = F::defaults(given->kind);
  const std::size_t known = std::min(size, sizeof(Settings));
  std::memcpy(static_cast<void*>(&settings), given, known);
  const auto* bytes = reinterpret_cast<const unsigned char*>(given);
  for (std::size_t i = known; i < size; ++i)
    if (bytes[i] != 0)
      return fail(error, RESONID_ERROR_SETTINGS, "struct_size",
                  "has fields set that this library does not know");
  return RESONID_OK;
}

/// A family from its description F: kId, kTypes, Settings, Results, defaults(kind), variant(settings),
/// build(memory, variant, settings), operations(variant). A kind of another family never comes here.
template <class F>
struct FamilyOf {
  using Settings = typename F::Settings;
  static_assert(std::is_standard_layout_v<Settings> && offsetof(Settings, head) == 0);
  static_assert(std::is_standard_layout_v<typename F::Results> && offsetof(typename F::Results, head) == 0);

  static resonid_status defaults(resonid_settings* out, std::size_t size, std::uint32_t kind) noexcept {
    if (out == nullptr) return RESONID_ERROR_NULL;
    if (!possible_size<Settings>(size)) return RESONID_ERROR_SIZE;
    Settings settings = F::defaults(kind);
    settings.head = {static_cast<std::uint32_t>(size), kind};
    std::memset(static_cast<void*>(out), 0, size);  // also what only a newer header knows
    std::memcpy(static_cast<void*>(out), &settings, std::min(size, sizeof settings));
    return RESONID_OK;
  }
  static std::size_t size(const resonid_settings* given) noexcept {
    Settings settings;
    if (take<F>(given, settings, nullptr) != RESONID_OK) return 0;
    const auto variant = F::variant(settings);
    return variant ? F::operations(*variant)->size : 0;
  }
  static resonid_status init(void* memory, std::size_t room, const resonid_settings* given,
                             resonid_error* error) noexcept {
    Settings settings;
    if (const resonid_status status = take<F>(given, settings, error)) return status;
    const auto variant = F::variant(settings);
    if (!variant) return fail(error, variant.error());
    if (memory == nullptr) return fail_null(error, "memory");
    if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0)
      return fail(error, RESONID_ERROR_ALIGNMENT, "memory", "must be aligned to RESONID_ALIGNMENT");
    if (room < F::operations(*variant)->size)
      return fail(error, RESONID_ERROR_SIZE, "size", "must be what resonid_size() says",
                  static_cast<double>(room));
    const expected<void> built = F::build(memory, *variant, settings);
    return built ? RESONID_OK : fail(error, built.error());
  }
  static resonid_status read(const Operations& o, const Header& h, resonid_results* out,
                             std::size_t size) noexcept {
    typename F::Results results{};
    o.read(&h, &results);
    results.head.kind = h.kind;
    return give(results, out, size);
  }
  static constexpr Family kFamily{F::kId, F::kTypes, &defaults, &size, &init, &read, &F::operations};
};

/// The types that a handle of one family may hold, told apart by their number in the header.
template <class F, class... Ts>
struct Variants {
  static constexpr std::uint32_t kCount = sizeof...(Ts);

  static const Operations* operations(std::uint32_t variant) noexcept {
    static constexpr Operations kOperations[] = {operations_for<F, Ts>()...};
    return variant < kCount ? &kOperations[variant] : nullptr;
  }
  /// f(estimator) of whatever type is there, for what only this family does; f gives a status, or nothing.
  template <class Handle, class Function>
  static resonid_status visit(Handle* handle, Function&& f) noexcept {
    if (const resonid_status status = check_handle(handle)) return status;
    const Header& h = *reinterpret_cast<const Header*>(handle);
    if (family_of(h.kind) != F::kId)
      return operations_of(h) != nullptr ? RESONID_ERROR_UNSUPPORTED : RESONID_ERROR_HANDLE;
    using Address = std::conditional_t<std::is_const_v<Handle>, const void*, void*>;
    using Call = resonid_status (*)(Address, std::remove_reference_t<Function>&) noexcept;
    static constexpr Call kCall[] = {&call<Ts, Address, std::remove_reference_t<Function>>...};
    const bool known =
        type_of(h.kind) < F::kTypes && h.variant < kCount && h.size == operations(h.variant)->size;
    return known ? kCall[h.variant](static_cast<Address>(handle), f) : RESONID_ERROR_HANDLE;
  }

 private:
  template <class T, class Address, class Function>
  static resonid_status call(Address handle, Function& f) noexcept {
    if constexpr (std::is_void_v<decltype(f(content<T>(handle)))>) {
      f(content<T>(handle));
      return RESONID_OK;
    } else {
      return f(content<T>(handle));
    }
  }
};

}  // namespace resonid::c
