// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <bit>
#include <resonid/base/expected.hpp>

#include "case.hpp"

/// Room for an estimator that has no default constructor: in RAM that is zero at the start, without heap.
template <class T>
class Storage {
 public:
  template <class Expected>
  bool hold(const Expected& made) {
    if (!made) return false;
    new (&bytes_) T(*made);
    return true;
  }
  T& operator*() { return *std::launder(reinterpret_cast<T*>(&bytes_)); }
  T* operator->() { return &**this; }

 private:
  alignas(T) std::array<std::byte, sizeof(T)> bytes_{};
};

/// A case from a type with the static functions create(), step() and report() and the member type Estimator.
template <class T>
constexpr Case case_of(const char* name, Injection injection) {
  return {name, injection, sizeof(typename T::Estimator), T::create, T::step, T::report};
}
