! Example: the structure factor of hard discs, from frames that are taken while they run.
program sk_after_run
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   integer, parameter :: discs = 256, frames = 100, steps_between = 50, shells_shown = 8
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   type(gbg_analysis_t) :: analysis
   real(real64) :: x(2, discs), lengths(2)
   integer :: frame

   call context%create('cpu:threads=1')   ! so few discs are not worth more
   call make_scene()
   call engine%create(scene)
   call engine%get_box(lengths)

   call analysis%create(context, lengths)
   call analysis%set('k_max', 8.0_real64)
   call analysis%set('tolerance', 1e-8_real64)
   call engine%run(20*steps_between)   ! from the random start to rest
   do frame = 1, frames
      call engine%run(steps_between)
      call engine%get_positions(x)
      call analysis%add_frame(x)
   end do
   call print_shells()

   call analysis%destroy()
   call engine%destroy()
   call scene%destroy()
   call context%destroy()

contains

   subroutine make_scene()
      call scene%create(context, 2)
      call scene%add_species('disc', 1.0_real64, 0.0_real64, 1.0_real64, count=discs)
      call scene%set('box.packing', 0.4_real64)
      call scene%set('particles.start.random', 'insertion')
      call scene%set('excluded_volume.rule', 'auto')
      call scene%set('dynamics.dt', 0.004_real64)
      call scene%set('dynamics.temperature', 1.0_real64)
      call scene%set('run.seed', 3)
   end subroutine make_scene

   ! Shells of k: mean of |k|, S(k), its statistical error, and a hard bound of the numerical one.
   subroutine print_shells()
      real(real64), allocatable :: k(:), s(:), s_stderr(:), s_numerr(:)
      integer :: shells, frames_so_far, i
      call analysis%get_size(shells, frames_so_far)
      call analysis%get('k', k)
      call analysis%get('S', s)
      call analysis%get('S_stderr', s_stderr)
      call analysis%get('S_numerr', s_numerr)
      print '(a,1x,i0)', 'frames', frames_so_far
      print '(a,i0,1x,f14.9)', ('k_', i, k(i), i=1, shells_shown)
      print '(a,i0,1x,f14.9)', ('S_', i, s(i), i=1, shells_shown)
      print '(a,i0,1x,f14.9)', ('S_stderr_', i, s_stderr(i), i=1, shells_shown)
      print '(a,1x,i0)', 'numerical_error_below_1e-6', merge(1, 0, s_numerr(1) < 1e-6_real64)
   end subroutine print_shells
end program sk_after_run
