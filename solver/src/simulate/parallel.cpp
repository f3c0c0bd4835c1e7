#include "simulate/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace rille {

bool parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work, const std::function<bool()>& keep_going) {
  std::atomic<std::size_t> next = 0, at_work = 0;
  std::atomic<bool> stop = false;
  std::exception_ptr failure;
  std::mutex lock;
  const auto take = [&] {
    try {
      for (std::size_t k = next++; k < count && !stop; k = next++) work(k);
    } catch (...) {
      const std::lock_guard guard(lock);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
    --at_work;
  };
  const std::size_t wanted = threads > 0 ? static_cast<std::size_t>(threads) : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t n = std::min(wanted, count);
  std::vector<std::thread> pool;
  at_work = n;
  for (std::size_t t = 0; t < n; ++t) pool.emplace_back(take);
  bool called_off = false;
  while (keep_going && at_work > 0 && !called_off) {
    called_off = !keep_going();
    if (called_off) stop = true;
    else std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
  return !called_off;
}

}  // namespace rille
