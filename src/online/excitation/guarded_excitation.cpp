// SPDX-License-Identifier: MIT
#include <resonid/online/excitation/guarded_excitation.hpp>

namespace resonid::online {

std::string_view to_words(StopReason reason) noexcept {
  switch (reason) {
    case StopReason::none:
      return "not stopped";
    case StopReason::requested:
      return "stopped on request";
    case StopReason::finished:
      return "finished as planned";
    case StopReason::torque:
      return "stopped: the torque command with the excitation came too near to its limit";
    case StopReason::velocity:
      return "stopped: the velocity came too near to its limit";
    case StopReason::position:
      return "stopped: the machine could no longer stop within the position window";
    case StopReason::oscillation:
      return "stopped: an oscillation grew that the excitation does not explain";
    case StopReason::signal_lost:
      return "stopped: a measurement that a limit needs was missing for too long";
    case StopReason::watchdog_amplitude:
      return "stopped: the tracked amplitude came too near to its limit";
    case StopReason::watchdog_silent:
      return "stopped: no tracked amplitude was reported for too long";
  }
  return "";
}

template class GuardedExcitation<double>;
template class GuardedExcitation<float>;

}  // namespace resonid::online
