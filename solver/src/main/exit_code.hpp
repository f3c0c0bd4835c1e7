// Exit codes of the program.
#pragma once

enum ExitCode { kDone = 0, kBug = 1, kUsage = 2, kRefused = 3, kPhysics = 4, kInterrupted = 130 };
