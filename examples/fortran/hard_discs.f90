! Example: Brownian hard discs at area fraction 0.52. By how much do they slow each other down?
program hard_discs
   use, intrinsic :: iso_fortran_env, only: real64
   use gamboge
   implicit none
   integer, parameter :: discs = 1024, steps = 400
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   real(real64) :: first(2, discs), last(2, discs), diameter(discs), lengths(2), time
   integer :: rounds, overlaps

   ! A call that fails without stat stops the program with a message; with stat it returns.
   call context%create('auto')
   call make_scene()
   call engine%create(scene)

   call engine%get_positions(first, wrapped=.false.)
   call engine%run(steps)
   call engine%get_positions(last, wrapped=.false.)
   call engine%get('time', time)
   call engine%get('contact_rounds', rounds)

   ! The same question to a kernel that knows nothing of the run.
   diameter = 1
   call engine%get_box(lengths)
   call gbg_overlaps_find(context, lengths, last, diameter, overlaps, tolerance=1e-12_real64)

   call print_results()

   call engine%destroy()
   call scene%destroy()
   call context%destroy()

contains

   subroutine make_scene()
      call scene%create(context, 2)
      call scene%add_species('disc', 1.0_real64, 0.0_real64, 1.0_real64, count=discs)
      call scene%set('box.packing', 0.52_real64)
      call scene%set('particles.start.lattice', 'triangular')
      call scene%set('particles.start.jitter', 0.8_real64)
      call scene%set('excluded_volume.rule', 'auto')
      call scene%set('dynamics.dt', 0.01_real64)
      call scene%set('dynamics.temperature', 0.01_real64)
      call scene%set('run.seed', 7)
      call scene%set('output.trajectory.unwrapped', .true.)
   end subroutine make_scene

   subroutine print_results()
      character(:), allocatable :: hash
      call engine%hash(hash)
      ! Free discs have D = temperature/2, so that their MSD is 4 D t.
      print '(a,1x,i0)', 'discs', discs
      print '(a,1x,f18.12)', 'box_length', lengths(1)
      print '(a,1x,i0)', 'contact_rounds_above_0', merge(1, 0, rounds > 0)
      print '(a,1x,i0)', 'overlaps_found', overlaps
      print '(a,1x,f14.9)', 'msd_over_free', sum((last - first)**2)/discs/(4*0.005_real64*time)
      print '(a,1x,a)', 'hash', hash
   end subroutine print_results
end program hard_discs
