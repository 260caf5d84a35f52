! L5: the constants of the C headers, under their C names.
module gamboge_constants
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private

   ! Statuses (status.h). 0: done. Positive: the call was refused and nothing changed. Negative: the
   ! object is spent. gbg_status_text says what each means, docs/errors.md what to do.
   integer(c_int), parameter, public :: gbg_ok = 0
   integer(c_int), parameter, public :: gbg_e_argument = 1
   integer(c_int), parameter, public :: gbg_e_name = 2
   integer(c_int), parameter, public :: gbg_e_scene = 3
   integer(c_int), parameter, public :: gbg_e_file = 4
   integer(c_int), parameter, public :: gbg_e_format = 5
   integer(c_int), parameter, public :: gbg_e_unbuilt = 6
   integer(c_int), parameter, public :: gbg_e_memory = 7
   integer(c_int), parameter, public :: gbg_e_overlap = 8
   integer(c_int), parameter, public :: gbg_e_step = 9
   integer(c_int), parameter, public :: gbg_e_order = 10
   integer(c_int), parameter, public :: gbg_e_space = 11
   integer(c_int), parameter, public :: gbg_e_internal = -1
   integer(c_int), parameter, public :: gbg_e_device = -2

   ! Limits of a scene (scene.h).
   integer(c_int), parameter, public :: gbg_max_species = 10
   integer(c_int), parameter, public :: gbg_max_forces = 8

   ! Levels of a log line (context.h).
   integer(c_int), parameter, public :: gbg_log_info = 0
   integer(c_int), parameter, public :: gbg_log_warning = 1
end module gamboge_constants
