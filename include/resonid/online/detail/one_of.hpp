// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

namespace resonid::online::detail {

/// One of several trivially copyable types, or none yet: std::variant without what needs a C++ run-time
/// library. What the one does not take of the room is left as it was: memory that is zero is not touched.
template <class... Types>
class OneOf {
 public:
  OneOf() = default;
  template <class T>
  explicit OneOf(const T& value) noexcept {
    ::new (place_for<T>()) T(value);
  }
  /// Where one of the type is to be constructed, at once.
  template <class T>
  [[nodiscard]] void* place_for() noexcept {
    static_assert((std::is_same_v<T, Types> || ...));
    static_assert((std::is_trivially_copyable_v<Types> && ...));
    which_ = index_of<T>();
    return bytes_;
  }

  template <class Function>
  decltype(auto) visit(Function&& f) noexcept {
    return visit_from<0, Types...>(*this, f);
  }
  template <class Function>
  decltype(auto) visit(Function&& f) const noexcept {
    return visit_from<0, Types...>(*this, f);
  }
  /// As of construction.
  void clear() noexcept { which_ = sizeof...(Types); }
  [[nodiscard]] bool holds_one() const noexcept { return which_ < sizeof...(Types); }
  /// For a state of unknown origin (base/detail/intact.hpp): none, or one that is intact.
  [[nodiscard]] bool intact() const noexcept {
    if (which_ >= sizeof...(Types)) return which_ == sizeof...(Types);
    return visit([](const auto& one) {
      if constexpr (requires { one.intact(); })
        return one.intact();
      else
        return true;
    });
  }
  template <class T>
  [[nodiscard]] T* get_if() noexcept {
    return which_ == index_of<T>() ? as<T>() : nullptr;
  }
  template <class T>
  [[nodiscard]] const T* get_if() const noexcept {
    return which_ == index_of<T>() ? as<T>() : nullptr;
  }

 private:
  template <class T>
  static constexpr std::size_t index_of() noexcept {
    std::size_t i = 0;
    static_cast<void>(((std::is_same_v<T, Types> ? true : (++i, false)) || ...));
    return i;
  }
  template <class T>
  [[nodiscard]] T* as() noexcept {
    return std::launder(reinterpret_cast<T*>(bytes_));
  }
  template <class T>
  [[nodiscard]] const T* as() const noexcept {
    return std::launder(reinterpret_cast<const T*>(bytes_));
  }
  template <std::size_t Index, class First, class... Rest, class Self, class Function>
  static decltype(auto) visit_from(Self& self, Function& f) noexcept {
    if constexpr (sizeof...(Rest) > 0) {
      if (self.which_ != Index) return visit_from<Index + 1, Rest...>(self, f);
    }
    return f(*self.template as<First>());
  }

  alignas(Types...) std::byte bytes_[std::max({sizeof(Types)...})];
  std::size_t which_ = sizeof...(Types);
};

}  // namespace resonid::online::detail
