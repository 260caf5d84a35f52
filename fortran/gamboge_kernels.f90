! L5: single kernels on the caller's own arrays, for a code that keeps its run. Coordinates are
! x(2,n), x(3,n) or x(n), y(n) and, in three dimensions, z(n), in any layout, any finite value,
! taken modulo the box; the number of box lengths is the dimension. Particles count from 1. Single
! precision, or separate arrays of different strides, cost a copy.
module gamboge_kernels
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: int32, int64, real32, real64
   use gamboge_c, only: c_overlaps_find => gbg_overlaps_find, &
      c_overlaps_remove => gbg_overlaps_remove, c_pair_forces => gbg_pair_forces, gbg_ok
   use gamboge_context, only: context_of, gbg_context_t
   use gamboge_layout, only: drop, match_size, points, put_back, take
   use gamboge_tools, only: c_text, context_handle, narrow, report
   implicit none
   private

   public :: gbg_pair_forces, gbg_overlaps_find, gbg_overlaps_remove

   ! F_i = mobility_i sum over k of alpha_k r_ik/|r_ik|**(power+1), nearest image of each k.
   interface gbg_pair_forces
      module procedure forces_matrix64, forces_two64, forces_three64
      module procedure forces_matrix32, forces_two32, forces_three32
   end interface gbg_pair_forces

   ! Pairs closer than (d_i + d_j)/2 (1 - tolerance).
   interface gbg_overlaps_find
      module procedure find_matrix64, find_two64, find_three64
      module procedure find_matrix32, find_two32, find_three32
      module procedure find_matrix64_int64, find_two64_int64, find_three64_int64
   end interface gbg_overlaps_find

   ! Moves overlapping particles apart, in place, until no pair overlaps. Rounding to single
   ! precision can bring back overlaps of 1e-7 of a coordinate.
   interface gbg_overlaps_remove
      module procedure remove_matrix64, remove_two64, remove_three64
      module procedure remove_matrix32, remove_two32, remove_three32
   end interface gbg_overlaps_remove

contains

   subroutine forces_matrix64(context, lengths, power, x, alpha, mobility, f, cutoff, &
         precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      ! of the box, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in) :: power
      ! [length]
      real(real64), intent(in), target :: x(:, :)
      ! source strength and response of each particle
      real(real64), intent(in), contiguous :: alpha(:), mobility(:)
      ! receives the forces, shape and layout of its own
      real(real64), intent(inout), target :: f(:, :)
      ! [length], at most half the shortest box length; 0 or absent: all pairs
      real(real64), intent(in), optional :: cutoff
      ! 'mixed' (the default: 32-bit pairs, 64-bit sums), 'double' or
      ! 'strict' (mixed, the same bits on every processor and GPU)
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x)
      call take(q, 'gbg_pair_forces', size(lengths), f)
      call forces(context, lengths, power, p, alpha, mobility, q, cutoff, precision)
      call put_back(q, f)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_matrix64

   subroutine forces_two64(context, lengths, power, x, y, alpha, mobility, fx, fy, cutoff, &
         precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in) :: power
      real(real64), intent(in), target :: x(:), y(:)
      real(real64), intent(in), contiguous :: alpha(:), mobility(:)
      real(real64), intent(inout), target :: fx(:), fy(:)
      real(real64), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x, y)
      call take(q, 'gbg_pair_forces', size(lengths), fx, fy)
      call forces(context, lengths, power, p, alpha, mobility, q, cutoff, precision)
      call put_back(q, fx, fy)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_two64

   subroutine forces_three64(context, lengths, power, x, y, z, alpha, mobility, fx, fy, fz, &
         cutoff, precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in) :: power
      real(real64), intent(in), target :: x(:), y(:), z(:)
      real(real64), intent(in), contiguous :: alpha(:), mobility(:)
      real(real64), intent(inout), target :: fx(:), fy(:), fz(:)
      real(real64), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x, y, z)
      call take(q, 'gbg_pair_forces', size(lengths), fx, fy, fz)
      call forces(context, lengths, power, p, alpha, mobility, q, cutoff, precision)
      call put_back(q, fx, fy, fz)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_three64

   subroutine forces_matrix32(context, lengths, power, x, alpha, mobility, f, cutoff, &
         precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: power
      real(real32), intent(in) :: x(:, :)
      real(real32), intent(in) :: alpha(:), mobility(:)
      real(real32), intent(inout) :: f(:, :)
      real(real32), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: reach
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x)
      call take(q, 'gbg_pair_forces', size(lengths), f)
      reach = 0
      if (present(cutoff)) reach = cutoff
      call forces(context, real(lengths, real64), real(power, real64), p, real(alpha, real64), &
                  real(mobility, real64), q, reach, precision)
      call put_back(q, f)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_matrix32

   subroutine forces_two32(context, lengths, power, x, y, alpha, mobility, fx, fy, cutoff, &
         precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: power
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in) :: alpha(:), mobility(:)
      real(real32), intent(inout) :: fx(:), fy(:)
      real(real32), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: reach
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x, y)
      call take(q, 'gbg_pair_forces', size(lengths), fx, fy)
      reach = 0
      if (present(cutoff)) reach = cutoff
      call forces(context, real(lengths, real64), real(power, real64), p, real(alpha, real64), &
                  real(mobility, real64), q, reach, precision)
      call put_back(q, fx, fy)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_two32

   subroutine forces_three32(context, lengths, power, x, y, z, alpha, mobility, fx, fy, fz, &
         cutoff, precision, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: power
      real(real32), intent(in) :: x(:), y(:), z(:)
      real(real32), intent(in) :: alpha(:), mobility(:)
      real(real32), intent(inout) :: fx(:), fy(:), fz(:)
      real(real32), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: reach
      type(points) :: p, q
      call take(p, 'gbg_pair_forces', size(lengths), x, y, z)
      call take(q, 'gbg_pair_forces', size(lengths), fx, fy, fz)
      reach = 0
      if (present(cutoff)) reach = cutoff
      call forces(context, real(lengths, real64), real(power, real64), p, real(alpha, real64), &
                  real(mobility, real64), q, reach, precision)
      call put_back(q, fx, fy, fz)
      call report(context_of(context), q%status, stat, errmsg, q%problem)
   end subroutine forces_three32

   subroutine forces(context, lengths, power, p, alpha, mobility, q, cutoff, precision)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:), power
      type(points), intent(inout) :: p
      real(real64), intent(in), contiguous :: alpha(:), mobility(:)
      ! receives forces, status and problem
      type(points), intent(inout) :: q
      real(real64), intent(in), optional :: cutoff
      character(*), intent(in), optional :: precision
      character(:), allocatable :: kind
      real(real64) :: reach
      reach = 0
      kind = 'mixed'
      if (present(cutoff)) reach = cutoff
      if (present(precision)) kind = precision
      call match_size(p, 'gbg_pair_forces', 'alpha', size(alpha, kind=int64))
      call match_size(p, 'gbg_pair_forces', 'mobility', size(mobility, kind=int64))
      call match_size(p, 'gbg_pair_forces', 'the array of forces', q%n)
      if (p%status /= gbg_ok) then
         q%status = p%status
         q%problem = p%problem
      end if
      if (q%status == gbg_ok) q%status = &
         c_pair_forces(context_handle(context_of(context)), size(lengths), lengths, power, reach, &
                       c_text(kind), p%n, p%x, p%y, p%z, p%step, alpha, mobility, q%x, q%y, q%z, &
                       q%step)
      call drop(p)
   end subroutine forces

   subroutine find_matrix64(context, lengths, x, diameter, count, first, second, tolerance, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      ! of the box, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      ! [length]
      real(real64), intent(in), target :: x(:, :)
      ! of each particle [length]
      real(real64), intent(in), contiguous :: diameter(:)
      ! number of overlapping pairs, also of those for which there was no room
      integer(int32), intent(inout) :: count
      ! receive the pairs as far as there is room, first < second, sorted
      integer(int32), intent(inout), optional :: first(:), second(:)
      ! of the distance, relative; 0 without it
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x)
      call find(context, lengths, p, diameter, found, first, second, tolerance)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_matrix64

   subroutine find_two64(context, lengths, x, y, diameter, count, first, second, tolerance, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in), target :: x(:), y(:)
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int32), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y)
      call find(context, lengths, p, diameter, found, first, second, tolerance)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_two64

   subroutine find_three64(context, lengths, x, y, z, diameter, count, first, second, &
         tolerance, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in), target :: x(:), y(:), z(:)
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int32), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y, z)
      call find(context, lengths, p, diameter, found, first, second, tolerance)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_three64

   subroutine find_matrix32(context, lengths, x, diameter, count, first, second, tolerance, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: x(:, :)
      real(real32), intent(in) :: diameter(:)
      integer(int32), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real32), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: slack
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x)
      slack = 0
      if (present(tolerance)) slack = tolerance
      call find(context, real(lengths, real64), p, real(diameter, real64), found, first, second, &
                slack)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_matrix32

   subroutine find_two32(context, lengths, x, y, diameter, count, first, second, tolerance, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: x(:), y(:)
      real(real32), intent(in) :: diameter(:)
      integer(int32), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real32), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: slack
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y)
      slack = 0
      if (present(tolerance)) slack = tolerance
      call find(context, real(lengths, real64), p, real(diameter, real64), found, first, second, &
                slack)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_two32

   subroutine find_three32(context, lengths, x, y, z, diameter, count, first, second, &
         tolerance, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(in) :: x(:), y(:), z(:)
      real(real32), intent(in) :: diameter(:)
      integer(int32), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real32), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      real(real64) :: slack
      integer(int64) :: found
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y, z)
      slack = 0
      if (present(tolerance)) slack = tolerance
      call find(context, real(lengths, real64), p, real(diameter, real64), found, first, second, &
                slack)
      call narrow('gbg_overlaps_find: count', found, count, p%status, p%problem)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_three32

   subroutine find_matrix64_int64(context, lengths, x, diameter, count, first, second, &
         tolerance, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in), target :: x(:, :)
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int64), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x)
      call find(context, lengths, p, diameter, count, first, second, tolerance)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_matrix64_int64

   subroutine find_two64_int64(context, lengths, x, y, diameter, count, first, second, &
         tolerance, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in), target :: x(:), y(:)
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int64), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y)
      call find(context, lengths, p, diameter, count, first, second, tolerance)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_two64_int64

   subroutine find_three64_int64(context, lengths, x, y, z, diameter, count, first, second, &
         tolerance, stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(in), target :: x(:), y(:), z(:)
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int64), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_find', size(lengths), x, y, z)
      call find(context, lengths, p, diameter, count, first, second, tolerance)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine find_three64_int64

   subroutine find(context, lengths, p, diameter, count, first, second, tolerance)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      type(points), intent(inout) :: p
      real(real64), intent(in), contiguous :: diameter(:)
      integer(int64), intent(inout) :: count
      integer(int32), intent(inout), optional :: first(:), second(:)
      real(real64), intent(in), optional :: tolerance
      integer(int32), allocatable :: a(:), b(:)
      integer(int64) :: capacity
      real(real64) :: slack
      slack = 0
      capacity = 0
      if (present(tolerance)) slack = tolerance
      if (present(first) .and. present(second)) &
         capacity = min(size(first, kind=int64), size(second, kind=int64))
      allocate (a(capacity), b(capacity))
      call match_size(p, 'gbg_overlaps_find', 'diameter', size(diameter, kind=int64))
      if (p%status == gbg_ok) p%status = &
         c_overlaps_find(context_handle(context_of(context)), size(lengths), lengths, p%n, p%x, &
                         p%y, p%z, p%step, diameter, slack, 1_c_int, capacity, a, b, count)
      if (p%status == gbg_ok .and. capacity > 0) then
         capacity = min(capacity, count)
         first(:capacity) = a(:capacity)
         second(:capacity) = b(:capacity)
      end if
      call drop(p)
   end subroutine find

   subroutine remove_matrix64(context, lengths, x, diameter, rule, max_rounds, rounds, stat, &
         errmsg)
      type(gbg_context_t), intent(in) :: context
      ! of the box, 2 or 3 of them [length]
      real(real64), intent(in) :: lengths(:)
      ! [length]
      real(real64), intent(inout), target :: x(:, :)
      ! of each particle [length]
      real(real64), intent(in), contiguous :: diameter(:)
      ! 'contact' (the default) or 'bounce'
      character(*), intent(in), optional :: rule
      ! 10000 without it; gbg_e_step, with nothing moved, when they were not enough
      integer, intent(in), optional :: max_rounds
      ! receives how many it took
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x)
      call remove(context, lengths, p, diameter, rule, max_rounds, rounds)
      call put_back(p, x)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_matrix64

   subroutine remove_two64(context, lengths, x, y, diameter, rule, max_rounds, rounds, stat, &
         errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(inout), target :: x(:), y(:)
      real(real64), intent(in), contiguous :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x, y)
      call remove(context, lengths, p, diameter, rule, max_rounds, rounds)
      call put_back(p, x, y)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_two64

   subroutine remove_three64(context, lengths, x, y, z, diameter, rule, max_rounds, rounds, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      real(real64), intent(inout), target :: x(:), y(:), z(:)
      real(real64), intent(in), contiguous :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x, y, z)
      call remove(context, lengths, p, diameter, rule, max_rounds, rounds)
      call put_back(p, x, y, z)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_three64

   subroutine remove_matrix32(context, lengths, x, diameter, rule, max_rounds, rounds, stat, &
         errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(inout) :: x(:, :)
      real(real32), intent(in) :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x)
      call remove(context, real(lengths, real64), p, real(diameter, real64), rule, max_rounds, &
                  rounds)
      call put_back(p, x)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_matrix32

   subroutine remove_two32(context, lengths, x, y, diameter, rule, max_rounds, rounds, stat, &
         errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(inout) :: x(:), y(:)
      real(real32), intent(in) :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x, y)
      call remove(context, real(lengths, real64), p, real(diameter, real64), rule, max_rounds, &
                  rounds)
      call put_back(p, x, y)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_two32

   subroutine remove_three32(context, lengths, x, y, z, diameter, rule, max_rounds, rounds, &
         stat, errmsg)
      type(gbg_context_t), intent(in) :: context
      real(real32), intent(in) :: lengths(:)
      real(real32), intent(inout) :: x(:), y(:), z(:)
      real(real32), intent(in) :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      type(points) :: p
      call take(p, 'gbg_overlaps_remove', size(lengths), x, y, z)
      call remove(context, real(lengths, real64), p, real(diameter, real64), rule, max_rounds, &
                  rounds)
      call put_back(p, x, y, z)
      call report(context_of(context), p%status, stat, errmsg, p%problem)
   end subroutine remove_three32

   subroutine remove(context, lengths, p, diameter, rule, max_rounds, rounds)
      type(gbg_context_t), intent(in) :: context
      real(real64), intent(in) :: lengths(:)
      type(points), intent(inout) :: p
      real(real64), intent(in), contiguous :: diameter(:)
      character(*), intent(in), optional :: rule
      integer, intent(in), optional :: max_rounds
      integer, intent(inout), optional :: rounds
      character(:), allocatable :: kind
      integer(int64) :: most, took
      kind = 'contact'
      most = 0
      if (present(rule)) kind = rule
      if (present(max_rounds)) most = max_rounds
      call match_size(p, 'gbg_overlaps_remove', 'diameter', size(diameter, kind=int64))
      if (p%status /= gbg_ok) return
      p%status = c_overlaps_remove(context_handle(context_of(context)), size(lengths), lengths, &
                                   p%n, p%x, p%y, p%z, p%step, diameter, c_text(kind), most, took)
      if (p%status == gbg_ok .and. present(rounds)) rounds = int(took)
   end subroutine remove
end module gamboge_kernels
