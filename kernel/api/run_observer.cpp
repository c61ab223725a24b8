#include "kernel/api/run_observer.hpp"

namespace soda::kernel {

std::vector<std::unique_ptr<LogicalProcess>> observed(
    std::span<const std::unique_ptr<LogicalProcess>> lps, RunObserver& observer) {
  std::vector<std::unique_ptr<LogicalProcess>> wrapped;
  for (std::uint32_t i = 0; i < lps.size(); ++i)
    wrapped.push_back(std::make_unique<ObservedProcess>(LpId{i}, *lps[i], observer));
  return wrapped;
}

void ObserverList::on_send(const Message& message) {
  for (RunObserver* observer : observers_) observer->on_send(message);
}

void ObserverList::on_deliver(const Message& message) {
  for (RunObserver* observer : observers_) observer->on_deliver(message);
}

void ObserverList::on_drop(const Message& message) {
  for (RunObserver* observer : observers_) observer->on_drop(message);
}

void ObserverList::on_execute(LpId lp, VirtualTime now, std::span<const MessageView> bag,
                              std::uint64_t digest) {
  for (RunObserver* observer : observers_) observer->on_execute(lp, now, bag, digest);
}

void ObserverList::on_absorb(LpId lp, VirtualTime now, std::span<const MessageView> bag) {
  for (RunObserver* observer : observers_) observer->on_absorb(lp, now, bag);
}

void ObserverList::on_jump(LpId lp, VirtualTime now, VirtualTime resume) {
  for (RunObserver* observer : observers_) observer->on_jump(lp, now, resume);
}

void ObserverList::on_rewind(LpId lp, VirtualTime restart) {
  for (RunObserver* observer : observers_) observer->on_rewind(lp, restart);
}

void ObserverList::on_commit(LpId lp, VirtualTime now) {
  for (RunObserver* observer : observers_) observer->on_commit(lp, now);
}

void ObserverList::on_gvt(VirtualTime gvt, std::span<const VirtualTime> floors) {
  for (RunObserver* observer : observers_) observer->on_gvt(gvt, floors);
}

void ObserverList::on_end() {
  for (RunObserver* observer : observers_) observer->on_end();
}

}  // namespace soda::kernel
