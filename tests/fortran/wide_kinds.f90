! A client whose default kinds are 8 bytes: built with -fdefault-real-8, and again with
! -fdefault-integer-8 too, against the module that was built without.
program wide_kinds
   use gamboge
   implicit none
   integer, parameter :: n = 6
   type(gbg_context_t) :: context
   type(gbg_scene_t) :: scene
   type(gbg_engine_t) :: engine
   real :: x(2, n), back(2, n), noise(2, n), dt
   integer :: species(n), count, steps, i
   integer(4) :: stat
   character(200) :: errmsg
   do i = 1, n
      x(:, i) = [1.5*i, 0.7*i]
   end do
   species = 1
   call context%create('cpu')
   call scene%create(context, 2)
   call scene%set_box([20.0, 20.0])
   call scene%add_species('A', 1.0, 1.0, 1.0)
   call scene%add_particles(x, species)
   call scene%set('dynamics.dt', 0.01)
   call scene%set('run.seed', 5)
   call scene%get('dynamics.dt', dt)
   call engine%create(scene)
   call engine%get_size(count)
   call engine%run(3)
   call engine%get('step', steps)
   call engine%get_positions(back)
   call engine%get_species(species)
   call gbg_normals(context, 1, 0, 0, 0, noise, stat, errmsg)
   if (stat /= gbg_ok) error stop 'normals'
   if (abs(dt - 0.01) > 0) error stop 'dt was rounded'
   if (count /= n .or. steps /= 3 .or. any(species /= 1)) error stop 'counts'
   if (maxval(abs(back - x)) > 1e-12) error stop 'positions'
   call gbg_overlaps_find(context, [20.0, 20.0], x, [(2.0, i=1, n)], count)
   if (count /= n - 1) error stop 'overlaps'
   print '(a,i0,a,i0)', 'real kind ', kind(dt), ', integer kind ', kind(n)
end program wide_kinds
