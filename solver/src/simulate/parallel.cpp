#include "simulate/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace rille {

namespace {

constexpr std::chrono::milliseconds ASKED{20};  // between two questions whether to go on

}  // namespace

bool parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& work, const std::function<bool()>& keep_going) {
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> stop = false;
  std::size_t at_work = 0;
  std::exception_ptr failure;
  std::mutex lock;  // of at_work and failure
  std::condition_variable over;
  const auto take = [&] {
    try {
      for (std::size_t k = next++; k < count && !stop; k = next++) work(k);
    } catch (...) {
      const std::lock_guard guard(lock);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
    const std::lock_guard guard(lock);
    if (--at_work == 0) over.notify_one();  // under the lock: the waiting thread may end `over` as soon as it has it
  };
  const std::size_t wanted = threads > 0 ? static_cast<std::size_t>(threads) : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t n = std::min(wanted, count);
  std::vector<std::thread> pool;
  at_work = n;
  if (n == 1 && !keep_going) {  // a thread of its own would only cost
    take();
    if (failure) std::rethrow_exception(failure);
    return true;
  }
  for (std::size_t t = 0; t < n; ++t) pool.emplace_back(take);
  bool called_off = false;
  while (keep_going && !called_off) {
    {
      std::unique_lock guard(lock);
      if (over.wait_for(guard, ASKED, [&] { return at_work == 0; })) break;
    }
    called_off = !keep_going();
    if (called_off) stop = true;
  }
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
  return !called_off;
}

}  // namespace rille
