! L5: the engine's noise on the caller's own arrays: standard normal deviates that follow from
! (seed, run, step, particle id) alone, the same in any order and on any number of threads.
module gamboge_noise
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: c_normals => gbg_normals, gbg_e_argument, gbg_ok
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_tools, only: context_handle, report
   implicit none
   private

   public :: gbg_normals

   ! Into an array values(2,n) or values(3,n) without a copy, or into separate arrays or single
   ! precision with one.
   interface gbg_normals
      module procedure matrix64, separate64, matrix32, separate32
   end interface gbg_normals

contains

   subroutine matrix64(context, seed, run, at_step, first_id, values, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      ! integers of either kind: 0 to 2**32-1, step number, id of the first particle
      class(*), intent(in) :: seed, run, at_step, first_id
      ! component and particle, for the ids first_id, first_id+1, ...
      real(real64), intent(inout), contiguous :: values(:, :)
      ! 0, or why the call was refused; without it a failure stops the program
      integer, intent(out), optional :: stat
      ! set to a whole sentence (as much as it holds) by a failure only
      character(*), intent(inout), optional :: errmsg
      character(:), allocatable :: problem
      integer(c_int) :: status
      call draw(context, seed, run, at_step, first_id, values, status, problem)
      call report(context_of(context), status, stat, errmsg, problem)
   end subroutine matrix64

   subroutine separate64(context, seed, run, at_step, first_id, x, y, z, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      class(*), intent(in) :: seed, run, at_step, first_id
      real(real64), intent(inout) :: x(:), y(:)
      ! in three dimensions
      real(real64), intent(inout), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: values(:, :)
      character(:), allocatable :: problem
      integer :: sizes(3)
      integer(c_int) :: status
      sizes = size(x)
      sizes(2) = size(y)
      if (present(z)) sizes(3) = size(z)
      call room(sizes, merge(3, 2, present(z)), values, status, problem)
      if (status == gbg_ok) &
         call draw(context, seed, run, at_step, first_id, values, status, problem)
      if (status == gbg_ok) then
         x = values(1, :)
         y = values(2, :)
         if (present(z)) z = values(3, :)
      end if
      call report(context_of(context), status, stat, errmsg, problem)
   end subroutine separate64

   subroutine matrix32(context, seed, run, at_step, first_id, values, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      class(*), intent(in) :: seed, run, at_step, first_id
      real(real32), intent(inout) :: values(:, :)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: wide(:, :)
      character(:), allocatable :: problem
      integer(c_int) :: status
      allocate (wide(size(values, 1), size(values, 2)))
      call draw(context, seed, run, at_step, first_id, wide, status, problem)
      if (status == gbg_ok) values = real(wide, real32)
      call report(context_of(context), status, stat, errmsg, problem)
   end subroutine matrix32

   subroutine separate32(context, seed, run, at_step, first_id, x, y, z, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      class(*), intent(in) :: seed, run, at_step, first_id
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(inout), optional :: z(:)
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64), allocatable :: values(:, :)
      character(:), allocatable :: problem
      integer :: sizes(3)
      integer(c_int) :: status
      sizes = size(x)
      sizes(2) = size(y)
      if (present(z)) sizes(3) = size(z)
      call room(sizes, merge(3, 2, present(z)), values, status, problem)
      if (status == gbg_ok) &
         call draw(context, seed, run, at_step, first_id, values, status, problem)
      if (status == gbg_ok) then
         x = real(values(1, :), real32)
         y = real(values(2, :), real32)
         if (present(z)) z = real(values(3, :), real32)
      end if
      call report(context_of(context), status, stat, errmsg, problem)
   end subroutine separate32

   subroutine draw(context, seed, run, at_step, first_id, values, status, problem)
      type(gbg_context_t), intent(in) :: context
      class(*), intent(in) :: seed, run, at_step, first_id
      real(real64), intent(inout), contiguous :: values(:, :)
      integer(c_int), intent(out) :: status
      character(:), allocatable, intent(out) :: problem
      integer(int64) :: key, series, step, id
      status = gbg_ok
      call whole(seed, 'seed', key, status, problem)
      call whole(run, 'run', series, status, problem)
      call whole(at_step, 'at_step', step, status, problem)
      call whole(first_id, 'first_id', id, status, problem)
      if (status == gbg_ok) status = &
         c_normals(context_handle(context_of(context)), key, series, step, id, size(values, 1), &
                   size(values, 2, int64), values)
   end subroutine draw

   ! The value of an integer of either kind.
   subroutine whole(number, name, value, status, problem)
      class(*), intent(in) :: number
      character(*), intent(in) :: name
      integer(int64), intent(out) :: value
      integer(c_int), intent(inout) :: status
      character(:), allocatable, intent(inout) :: problem
      value = 0
      select type (number)
      type is (integer(int32))
         value = number
      type is (integer(int64))
         value = number
      class default
         status = gbg_e_argument
         problem = 'gbg_normals: '//name//' is not an integer(int32) or integer(int64)'
      end select
   end subroutine whole

   ! Space for the numbers of separate arrays, which have to agree in size.
   subroutine room(sizes, dimension, values, status, problem)
      integer, intent(in) :: sizes(3), dimension
      real(real64), allocatable, intent(out) :: values(:, :)
      integer(c_int), intent(out) :: status
      character(:), allocatable, intent(out) :: problem
      status = gbg_ok
      if (any(sizes /= sizes(1))) then
         status = gbg_e_argument
         problem = 'gbg_normals: x, y and z must have the same size'
         return
      end if
      allocate (values(dimension, sizes(1)))
   end subroutine room
end module gamboge_noise
