// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#include "error.hpp"

namespace resonid::c {

inline constexpr std::uint32_t kMagic = 0x64697352;  // "Rsid"
inline constexpr std::uint32_t kVersion =
    RESONID_VERSION_MAJOR * 65536 + RESONID_VERSION_MINOR * 256 + RESONID_VERSION_PATCH;

/// What every handle begins with; the estimator follows.
struct alignas(RESONID_ALIGNMENT) Header {
  std::uint32_t magic;
  std::uint32_t version;  ///< Of the library: the layout of the estimators may change with any.
  std::uint32_t family;
  std::uint32_t variant;  ///< Which of the family's types follows.
  std::uint64_t size;     ///< Header included.
};
static_assert(sizeof(Header) == RESONID_ALIGNMENT);

/// Whether there is a header of this family and version at the address, which may lack alignment.
resonid_status check_header(const void* memory, std::uint32_t family) noexcept;
/// The same for a handle that is to be used.
inline resonid_status check_handle(const void* memory, std::uint32_t family) noexcept {
  if (memory == nullptr) return RESONID_ERROR_NULL;
  if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0) return RESONID_ERROR_ALIGNMENT;
  const Header& h = *static_cast<const Header*>(memory);
  const bool known = h.magic == kMagic && h.version == kVersion && h.family == family;
  return known ? RESONID_OK : RESONID_ERROR_HANDLE;
}

[[nodiscard]] constexpr std::size_t whole_blocks(std::size_t size) noexcept {
  return (size + RESONID_ALIGNMENT - 1) / RESONID_ALIGNMENT * RESONID_ALIGNMENT;
}
template <class T>
[[nodiscard]] constexpr std::size_t handle_size() noexcept {
  static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= RESONID_ALIGNMENT);
  return sizeof(Header) + whole_blocks(sizeof(T));
}
template <class T>
[[nodiscard]] T& content(void* handle) noexcept {
  return *std::launder(reinterpret_cast<T*>(static_cast<unsigned char*>(handle) + sizeof(Header)));
}

/// The types that a handle of one family may hold, told apart by their number in the header. What is done
/// with the estimator goes through a table: one indirect call, however many types there are.
template <std::uint32_t Id, class... Ts>
struct Variants {
  static constexpr std::uint32_t kFamily = Id;
  static constexpr std::uint32_t kCount = sizeof...(Ts);
  static constexpr std::array<std::size_t, kCount> kSize{handle_size<Ts>()...};

  /// f(estimator) of whatever type is there; f gives a status, or nothing.
  template <class F>
  static resonid_status visit(void* handle, F&& f) noexcept {
    using Function = std::remove_reference_t<F>;
    using Call = resonid_status (*)(void*, Function&);
    static constexpr Call kCall[] = {&call<Ts, Function>...};
    if (const resonid_status status = check_handle(handle, Id)) return status;
    const Header& h = *static_cast<const Header*>(handle);
    const bool known = h.variant < kCount && h.size == kSize[h.variant];
    return known ? kCall[h.variant](handle, f) : RESONID_ERROR_HANDLE;
  }
  template <class F>
  static resonid_status visit(const void* handle, F&& f) noexcept {
    return visit(const_cast<void*>(handle), [&f](const auto& estimator) { return status_of(f, estimator); });
  }

 private:
  template <class F, class T>
  static resonid_status status_of(F& f, T& estimator) noexcept {
    if constexpr (std::is_void_v<decltype(f(estimator))>) {
      f(estimator);
      return RESONID_OK;
    } else {
      return f(estimator);
    }
  }
  template <class T, class F>
  static resonid_status call(void* handle, F& f) noexcept {
    return status_of(f, content<T>(handle));
  }
};

/// Puts a header and an estimator into memory that was found large enough; nothing of what was there
/// before shows beside what they leave out.
template <class T>
void place(void* memory, std::uint32_t family, std::uint32_t variant, const T& estimator) noexcept {
  std::memset(memory, 0, handle_size<T>());
  ::new (memory) Header{kMagic, kVersion, family, variant, handle_size<T>()};
  ::new (static_cast<unsigned char*>(memory) + sizeof(Header)) T(estimator);
}

// A family offers, besides Variants:
//   using Config, Handle
//   static Config defaults(kind)
//   static expected<std::uint32_t, Error> variant(const Config&)
//   static std::size_t size(variant)
//   static expected<void, Error> build(void* memory, variant, const Config&)

/// 0 when there is no such handle.
template <class Family>
std::size_t size_of(const typename Family::Config* given) noexcept {
  typename Family::Config config = Family::defaults_for(given);
  if (take(given, config, nullptr) != RESONID_OK) return 0;
  const auto variant = Family::variant(config);
  return variant ? Family::size(*variant) : 0;
}

template <class Family>
resonid_status init(void* memory, std::size_t room, const typename Family::Config* given,
                    typename Family::Handle** handle, resonid_error* error) noexcept {
  if (handle == nullptr) return fail_null(error, "handle");
  typename Family::Config config = Family::defaults_for(given);
  if (const resonid_status status = take(given, config, error)) return status;
  const auto variant = Family::variant(config);
  if (!variant) return fail(error, RESONID_ERROR_CONFIG, variant.error());
  if (memory == nullptr) return fail_null(error, "memory");
  if (reinterpret_cast<std::uintptr_t>(memory) % RESONID_ALIGNMENT != 0)
    return fail(error, RESONID_ERROR_ALIGNMENT, {"memory", "must be aligned to RESONID_ALIGNMENT"});
  if (room < Family::size(*variant))
    return fail(error, RESONID_ERROR_SIZE,
                {"size", "must be what the size function says", static_cast<double>(room)});
  if (const auto built = Family::build(memory, *variant, config); !built)
    return fail(error, RESONID_ERROR_CONFIG, built.error());
  *handle = static_cast<typename Family::Handle*>(memory);
  return RESONID_OK;
}

template <class Family>
resonid_status create(const typename Family::Config* given, typename Family::Handle** handle,
                      resonid_error* error) noexcept {
  if (handle == nullptr) return fail_null(error, "handle");
  const std::size_t size = size_of<Family>(given);
  // Without a size, init finds out what is wrong before it looks at the memory.
  void* memory = size > 0 ? std::aligned_alloc(RESONID_ALIGNMENT, size) : nullptr;
  if (size > 0 && memory == nullptr)
    return fail(error, RESONID_ERROR_MEMORY, {"config", "needs more memory than there is"});
  const resonid_status status = init<Family>(memory, size, given, handle, error);
  if (status != RESONID_OK) std::free(memory);
  return status;
}

/// The kind that the configuration says, for the defaults of what an older struct lacks.
template <class Config>
std::uint32_t second_field(const Config* given) noexcept {
  if (given == nullptr || given->struct_size < 2 * sizeof(std::uint32_t)) return 0;
  std::uint32_t kind = 0;
  std::memcpy(&kind, reinterpret_cast<const unsigned char*>(given) + sizeof(std::uint32_t), sizeof kind);
  return kind;
}

/// Refuses unless the caller's array has one place for each of `count` values.
inline resonid_status check_array(const void* array, std::size_t given, std::size_t count) noexcept {
  if (array == nullptr) return RESONID_ERROR_NULL;
  return given == count ? RESONID_OK : RESONID_ERROR_RANGE;
}

}  // namespace resonid::c
