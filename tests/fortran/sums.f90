! Long-range sums on arrays of every layout, and of a scene, against each other.
program sums
   use, intrinsic :: iso_fortran_env, only: int64, real32, real64
   use checking, only: check, check_close, check_text, finish
   use gamboge
   implicit none
   integer, parameter :: n = 120
   real(real64), parameter :: sides(3) = [9.0_real64, 7.0_real64, 8.0_real64]
   type(gbg_context_t) :: context

   call context%create('cpu:threads=2')
   call layouts(2)
   call layouts(3)
   call refusals()
   call engines()
   call finish()

contains

   ! Points that follow from their index, some outside the box.
   pure function made(dimension) result(x)
      integer, intent(in) :: dimension
      real(real64) :: x(dimension, n)
      integer :: a, i
      do i = 1, n
         do a = 1, dimension
            x(a, i) = sides(a)*(modulo(0.6180339887498949_real64*i*a + 0.31_real64*a*i*i, 3.0_real64) - 1)
         end do
      end do
   end function made

   subroutine layouts(axes)
      integer, intent(in) :: axes
      type(gbg_sum_t) :: forces
      real(real64) :: x(axes, n), f(axes, n), g(axes, n), wide(axes + 1, 2*n), alpha(n), mobility(n)
      real(real64) :: rms, median, potential(n)
      real(real32) :: single(axes, n), potential32(n)
      integer :: i
      x = made(axes)
      alpha = [(real(mod(i, 3) - 1, real64), i=1, n)]
      mobility = [(1 - 0.01_real64*i, i=1, n)]
      call forces%create(context, sides(:axes), 2.0_real64, n, tolerance=1e-5_real64)
      call forces%set_option('hurry', 'true')
      call forces%set_sources(alpha)
      call forces%set_positions(x)
      call forces%run()
      call forces%get_forces(f)
      rms = 1
      median = 1
      call forces%get_error(rms, median)
      call check(rms <= 1e-5_real64 .and. median < 1e-3_real64, 'error')

      wide = 0
      wide(:axes, ::2) = x
      call forces%set_positions(wide(:axes, ::2))
      call forces%run()
      call forces%get_forces(wide(:axes, 2::2), mobility)
      do i = 1, n
         call check(all(abs(wide(:axes, 2*i) - mobility(i)*f(:, i)) <= 1e-12_real64*abs(f(:, i))), &
                    'strided arrays and mobilities')
      end do

      g = 0
      if (axes == 2) then
         call forces%set_positions(x(1, :), x(2, :))
         call forces%run()
         call forces%get_forces(g(1, :), g(2, :))
      else
         call forces%set_positions(x(1, :), x(2, :), x(3, :))
         call forces%run()
         call forces%get_forces(g(1, :), g(2, :), g(3, :))
      end if
      call check(all(abs(g - f) <= 0), 'separate arrays')

      single = 0
      call forces%get_forces(single)
      call check(all(abs(single - real(f, real32)) <= 0), 'forces in single precision')
      call forces%get_potential(potential)
      call forces%get_potential(potential32)
      call check(all(abs(potential32 - real(potential, real32)) <= 0), 'potential')
      call check(any(abs(potential) > 0.1_real64), 'a potential that is not zero')
   end subroutine layouts

   subroutine refusals()
      type(gbg_sum_t) :: forces
      real(real64) :: x(2, n + 1), alpha(n)
      integer :: stat
      character(200) :: text
      alpha = 1
      x = 1
      call forces%create(context, sides(:2), 9.0_real64, int(n, int64), stat=stat, errmsg=text)
      call check(stat == gbg_e_argument .and. index(text, 'power is 9, allowed 1 to 6') > 0, text)
      call forces%run(stat=stat)
      call check(stat == gbg_e_argument, 'a sum that was not created')
      call forces%create(context, real(sides(:2), real32), 2.0_real32, n)
      call forces%create(context, sides(:2), 2.0_real64, n, stat=stat, errmsg=text)
      call check(stat == gbg_e_order .and. index(text, 'destroy it first') > 0, text)
      call forces%set_positions(x, stat, text)
      call check(stat == gbg_e_argument .and. index(text, 'the sum has 120 elements for 121') > 0, text)
      call forces%set_sources(alpha(:n - 1), stat, text)
      call check(stat == gbg_e_argument .and. index(text, 'alpha has 119 elements for 120') > 0, text)
      call forces%get_forces(x(:, :n), stat=stat, errmsg=text)
      call check(stat == gbg_e_order .and. index(text, 'gbg_sum_run comes first') > 0, text)
      call forces%destroy()
      call forces%destroy()
   end subroutine refusals

   ! A scene adds the same numbers.
   subroutine engines()
      type(gbg_scene_t) :: scene
      type(gbg_engine_t) :: engine
      type(gbg_sum_t) :: forces
      real(real64) :: x(2, n), f(2, n), g(2, n), tolerance, predicted, measured
      character(:), allocatable :: text
      integer :: refined
      x = made(2)
      call scene%create(context, 2)
      call scene%set_box(sides(:2))
      call scene%add_species('A', 0.0_real64, 1.0_real64, 1.0_real64)
      call scene%add_force(2, tolerance=1e-5_real64)
      call scene%set_force(1, 'gradient', 'window')
      call scene%add_particles(x)
      call engine%create(scene)
      call engine%get_forces(f)
      call engine%get_sum(1, tolerance, predicted, measured, refined)
      call check_close(tolerance, 1e-5_real64, 0.0_real64, 'tolerance')
      call check(measured >= 0 .and. measured <= tolerance .and. predicted > 0, 'measured error')
      call check(refined >= 0, 'refinements')
      call forces%create(context, sides(:2), 2.0_real64, n, tolerance=1e-5_real64)
      call forces%set_option('gradient', 'window')
      call forces%set_option('hurry', 'true')
      call forces%set_sources([(1.0_real64, refined=1, n)])
      call forces%set_positions(x)
      call forces%run()
      call forces%get_forces(g)
      call check(norm2(f - g) <= 2e-5_real64*norm2(f), 'the same forces')
      call forces%describe(text)
      call check(index(text, 'r/r^3, all images, slope: reach ') == 1, text)
      call forces%destroy()
      call forces%create(context, sides(:2), 3.0_real64, n, kind='minimum_image')
      call forces%describe(text)
      call check_text(text, 'r/r^4 over all pairs, nearest images, mixed', 'description')
   end subroutine engines
end program sums
